"""How far an answer on a fixed mesh is off, whoever gave it."""

from __future__ import annotations

import numpy as np

from benchmarks.large.problems import Large
from ocp import Problem, Trajectory
from ocp.problem.parameters import parameters_of
from ocp.scaling.scales import error_sizes
from ocp.verification.simulation import simulate

# A motion that amplifies errors by more is replayed from node to node, as far as they would grow to
# half of this: the engine asks the same of its answers.
UNSTABLE, REPLAY = 10.0, 1e-6


def judged(problem: Large, stated: Problem, objective: float, motion: Trajectory) -> float:
    """Error of the objective, relative, or of the replay in the states' sizes if that is more."""
    largest = {name: 0.0 for phase in motion.phases for name in phase.states}
    for phase in motion.phases:
        sizes = np.abs(np.concatenate(phase.state_polynomial.range())).max(axis=0)
        for name, size in zip(phase.states, sizes, strict=True):
            largest[name] = max(largest[name], float(size))
    sizes = error_sizes(parameters_of(stated), motion, {n: s or 1.0 for n, s in largest.items()})

    replay = simulate(stated, motion, sizes)
    if replay.miss > REPLAY and replay.amplification > UNSTABLE:
        most = 0.5 * REPLAY * replay.amplification / replay.miss
        replay = simulate(stated, motion, sizes, most=most)
    return max(problem.error(objective), replay.miss)
