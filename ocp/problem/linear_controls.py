"""Controls in which a phase is linear, so that they may have singular arcs.

Where the Hamiltonian is linear in a control, its slope by the control does not depend on it. At an
optimum the control is at a bound, or on a *singular arc*: there the slope vanishes for some time,
and the control follows from that (Bryson and Ho, "Applied Optimal Control", ch. 8).
"""

from __future__ import annotations

from functools import lru_cache

import casadi as ca

from ocp.numerics.linearity import is_linear
from ocp.problem.functionals import pieces_over
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import Control


@lru_cache(maxsize=256)
def enters_linearly(problem: Problem, phase: Phase, control: Control) -> bool:
    """Whether rates, integrands, peaks and bounds of a phase are linear in one of its controls.

    Their slopes by the control may depend on all else, other controls included.
    """
    expressions = [*phase.dynamics.values(), *(bound.expression for bound in phase.bounds)]
    expressions += [integral.expression for integral in problem.integrals[phase.name]]
    expressions += [expression for _, expression in pieces_over(problem.peaks, phase.name)]
    return is_linear(ca.vertcat(*expressions, ca.SX(0, 1)), control.symbol)
