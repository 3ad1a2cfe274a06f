"""Breakpoints at the known times at which expressions step or bend (`Problem.instants`).

They are those of phases whose times are fixed, where each is a fraction of the phase. A phase with
a free time has none: it is stated as two phases that meet at the known time.
"""

from __future__ import annotations

import numpy as np

from ocp.mesh.mesh import Mesh, with_points
from ocp.problem.problem import Problem
from ocp.problem.symbols import Between


def with_known_times(problem: Problem, mesh: Mesh) -> Mesh:
    """The mesh with a breakpoint at every known time; the very same one where it has them already.

    Points and back-offs between the collocation points count by interval, and are left out where
    intervals were added.
    """
    phases = []
    for phase, own in zip(problem.phases, mesh.phases, strict=True):
        if instants := problem.instants[phase.name]:
            # no phase of a free time has such instants
            assert not isinstance(phase.start, Between)
            assert not isinstance(phase.end, Between)
            start, end = float(phase.start), float(phase.end)
            own = with_points(own, (np.array(instants) - start) / (end - start))
        phases.append(own)
    same = all(a.intervals == b.intervals for a, b in zip(phases, mesh.phases, strict=True))
    return mesh if same else Mesh(tuple(phases))
