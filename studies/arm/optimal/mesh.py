"""Meshes of the arm's problems.

The smoothest torque bends evenly. Every other optimum turns its torque quickly at start, middle
and end; even meshes, however fine, did not resolve the fast modes there, and their optima of energy
were too high.
"""

from __future__ import annotations

import numpy as np

from ocp import Mesh
from ocp.mesh.mesh import PhaseMesh, uniform

DEGREE = 4
_GRADING = 0.9


def mesh_for(objective: str, intervals: int) -> Mesh:
    """Mesh of one stage."""
    return Mesh((uniform(intervals, DEGREE) if objective == "smoothest" else graded(intervals),))


def graded(intervals: int) -> PhaseMesh:
    """A mesh ten times finer at start, middle and end, x = s - a sin(4 pi s) / (4 pi)."""
    s = np.linspace(0.0, 1.0, intervals + 1)
    x = s - _GRADING * np.sin(4 * np.pi * s) / (4 * np.pi)
    return PhaseMesh(np.array([0.0, *x[1:-1], 1.0]), np.array([DEGREE]))
