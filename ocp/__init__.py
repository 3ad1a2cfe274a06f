"""Optimal control by direct collocation on CasADi and IPOPT.

State a problem with `State`, `Control`, `Phase` and `Problem`, hand it to `solve`, and read the
`Solution`, which has been refined, replayed by another integrator and checked between its points.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ocp.errors import (
    BudgetSpent,
    Collapsed,
    HomotopyStopped,
    Infeasible,
    Interrupted,
    InvalidNumber,
    IterationLimit,
    NumericalTrouble,
    OcpError,
    Overdetermined,
    SolveFailed,
    StatementError,
    StatementWarning,
    Unbounded,
    Unverified,
)
from ocp.ipopt import IpoptOptions
from ocp.mesh import Mesh
from ocp.settings import Settings
from ocp.solution import Round, Solution, Verification
from ocp.solve import collocate, solve
from ocp.statement import Phase, Problem, joined, peak, with_objective
from ocp.symbols import Algebraic, Between, Constant, Control, State, Unknown, time
from ocp.terms import Bound, Functional
from ocp.trajectory import PhaseTrajectory, Trajectory

if TYPE_CHECKING:
    from ocp.certificate import Certificate, Tolerances, certify
    from ocp.continuation import Homotopy, homotopy
    from ocp.elastic import Relaxation, Relaxed, relaxed
    from ocp.lexicographic import solve_lexicographic
    from ocp.many_starts import Audit, Optimum, audit
    from ocp.one_sided import ActiveSetWarning, Sided
    from ocp.prepared import Prepared, prepare
    from ocp.sizes import scaling_report
    from ocp.store import load, save

# what a solve does not need is loaded when it is asked for
_LATER = {
    "certificate": ("Certificate", "Tolerances", "certify"),
    "continuation": ("Homotopy", "homotopy"),
    "elastic": ("Relaxation", "Relaxed", "relaxed"),
    "lexicographic": ("solve_lexicographic",),
    "many_starts": ("Audit", "Optimum", "audit"),
    "one_sided": ("ActiveSetWarning", "Sided"),
    "prepared": ("Prepared", "prepare"),
    "sizes": ("scaling_report",),
    "store": ("load", "save"),
}
_MODULES = {name: module for module, names in _LATER.items() for name in names}

__all__ = [
    "ActiveSetWarning", "Algebraic", "Audit", "Between", "Bound", "BudgetSpent", "Certificate",
    "Collapsed", "Constant", "Control", "Functional", "Homotopy", "HomotopyStopped", "Infeasible",
    "Interrupted", "InvalidNumber", "IpoptOptions", "IterationLimit", "Mesh", "NumericalTrouble",
    "OcpError", "Optimum", "Overdetermined", "Phase", "PhaseTrajectory", "Prepared", "Problem",
    "Relaxation", "Relaxed", "Round", "Settings", "Sided", "Solution", "SolveFailed", "State",
    "StatementError", "StatementWarning", "Tolerances", "Trajectory", "Unbounded", "Unknown",
    "Unverified", "Verification", "audit", "certify", "collocate", "homotopy", "joined", "load",
    "peak", "prepare", "relaxed", "save", "scaling_report", "solve", "solve_lexicographic", "time",
    "with_objective",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """A name whose module is loaded on first use."""
    if name not in _MODULES:
        raise AttributeError(f"module 'ocp' has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(f"ocp.{_MODULES[name]}"), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
