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
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.nlp.ipopt import IpoptOptions
from ocp.problem.statement import Phase, Problem, joined, peak, with_objective
from ocp.problem.symbols import Algebraic, Between, Constant, Control, State, Unknown, time
from ocp.problem.terms import Bound, Functional
from ocp.settings import Settings
from ocp.solution.solution import Round, Solution, Verification
from ocp.solve import collocate, solve

if TYPE_CHECKING:
    from ocp.analysis.homotopy import Homotopy, homotopy
    from ocp.analysis.lexicographic import solve_lexicographic
    from ocp.analysis.multistart import Audit, Optimum, audit
    from ocp.analysis.one_sided import ActiveSetWarning, Sided
    from ocp.analysis.parametric import Prepared, prepare
    from ocp.analysis.relaxation import Relaxation, Relaxed, relaxed
    from ocp.solution.storage import load, save
    from ocp.transcription.scaling_report import scaling_report
    from ocp.verification.certificate import Certificate, Tolerances, certify

# what a solve does not need is loaded when it is asked for
_LATER = {
    "verification.certificate": ("Certificate", "Tolerances", "certify"),
    "analysis.homotopy": ("Homotopy", "homotopy"),
    "analysis.relaxation": ("Relaxation", "Relaxed", "relaxed"),
    "analysis.lexicographic": ("solve_lexicographic",),
    "analysis.multistart": ("Audit", "Optimum", "audit"),
    "analysis.one_sided": ("ActiveSetWarning", "Sided"),
    "analysis.parametric": ("Prepared", "prepare"),
    "transcription.scaling_report": ("scaling_report",),
    "solution.storage": ("load", "save"),
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
    if name == "__version__":
        from importlib.metadata import version  # reads a file, which an import need not wait for

        return version("antenna-ocp")
    if name not in _MODULES:
        raise AttributeError(f"module 'ocp' has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(f"ocp.{_MODULES[name]}"), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
