"""IPOPT's objects, kept for the next run of the same program.

Making one takes as long as several iterations of a small program: CasADi works out sparsity
patterns and sets IPOPT up. Along a family of motions the program stays, and only numbers change.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import casadi as ca

from ocp.nlp.watch import Watch
from ocp.transcription.kernels import Program


@dataclass(frozen=True, eq=False)
class KeptSolver:
    """An IPOPT object of a program.

    Attributes
    ----------
    options : dict
        That it was made with.
    watch : Watch
        Its callback.
    solver : ca.Function
    """

    options: Mapping[str, Any]
    watch: Watch
    solver: Any

    @classmethod
    def of(cls, program: Program, options: Mapping[str, Any]) -> KeptSolver:
        """A new one."""
        watch = Watch(program.variables, program.rows, program.constants)
        functions = {
            "grad_f": program.objective_gradient,
            "jac_g": program.constraint_jacobian,
            "hess_lag": program.lagrangian_hessian,
            "iteration_callback": watch,
        }
        solver = ca.nlpsol("solver", "ipopt", program.oracle, {**options, **functions})
        return cls(options, watch, solver)


# The last one of each program, which goes with the program. IPOPT frees its factors after a run.
_KEPT: WeakKeyDictionary[Program, KeptSolver] = WeakKeyDictionary()


@contextmanager
def kept_solver(program: Program, options: Mapping[str, Any]) -> Iterator[KeptSolver]:
    """Lend the IPOPT object of a program: the last one if it has the same options, or a new one.

    It is nobody else's inside the block: a run within a run, or in another thread, finds none and
    makes its own. One that an error came out of is not kept.

    Parameters
    ----------
    options : mapping
        Numbers and texts, of CasADi and of IPOPT.
    """
    kept = _KEPT.pop(program, None)
    if kept is None or kept.options != options:
        kept = KeptSolver.of(program, options)
    yield kept
    _KEPT[program] = kept
