"""States that nothing limits and that grow without bound.

With ``x' = x^2`` a motion is at infinity after a finite time. A mesh has no such motion, but one
that is off: each finer mesh follows it further up, and is off by more.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ocp.mesh.trajectory import PhaseTrajectory
from ocp.problem.symbols import State
from ocp.refinement.solved_mesh import SolvedMesh

# Meshes in a row on which a state grows and the dynamics are off by more than its size, and how
# many times it is as large on each as on the one before. A motion that is steep and finite is
# followed to its top by one of them, and then is off by less.
_MESHES = 4
_TIMES = 2.0
_FAR = 1.0


class Growth(NamedTuple):
    """A state that grows without bound.

    Attributes
    ----------
    phase : str
    state : State
    sign : float
        1 if it grows upwards, -1 if downwards.
    before, last : float
        Its modulus there on the first of the meshes, and on the last one [unit of the state].
    """

    phase: str
    state: State
    sign: float
    before: float
    last: float


def growth(solved: Sequence[SolvedMesh]) -> Growth | None:
    """A state that nothing limits and that grew without bound on the latest meshes, if one did."""
    latest = solved[-_MESHES:]
    if len(latest) < _MESHES or min(s.errors.dynamics for s in latest) < _FAR:
        return None
    last = latest[-1].iterate
    for phase in last.problem.phases:
        motions = [s.iterate.trajectory.phase(phase.name) for s in latest]
        for state in phase.states:
            limits = last.parameters.signal_limits[state.name]
            for sign, limit in zip((-1.0, 1.0), limits, strict=True):
                tops = [_top(motion, state, sign) for motion in motions]
                grows = all(new > _TIMES * max(old, 0.0) for old, new in itertools.pairwise(tops))
                if np.isinf(limit) and tops[0] > 0.0 and grows:
                    return Growth(phase.name, state, sign, tops[0], tops[-1])
    return None


def _top(motion: PhaseTrajectory, state: State, sign: float) -> float:
    """The largest value of a state at the breakpoints, in one direction [unit of the state]."""
    return float((sign * motion.polynomial(state.name).ends()).max())
