"""Optimal control by direct collocation on CasADi and IPOPT.

State a problem with `State`, `Control`, `Phase` and `Problem`, hand it to `solve`, and read the
`Solution`, which has been refined, replayed by another integrator and checked between its points.
"""

from ocp.audit import Audit, Optimum, audit
from ocp.certificate import Certificate, Tolerances, certify
from ocp.elastic import Relaxation, Relaxed, relaxed
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
from ocp.homotopy import Homotopy, homotopy
from ocp.ipopt import IpoptOptions
from ocp.lexicographic import solve_lexicographic
from ocp.mesh import Mesh
from ocp.one_sided import ActiveSetWarning, Sided
from ocp.prepared import Prepared, prepare
from ocp.scaling_report import scaling_report
from ocp.settings import Settings
from ocp.solution import Round, Solution, Verification
from ocp.solve import collocate, solve
from ocp.statement import Phase, Problem, joined, peak, with_objective
from ocp.store import load, save
from ocp.symbols import Algebraic, Between, Constant, Control, State, Unknown, time
from ocp.terms import Bound, Functional
from ocp.trajectory import PhaseTrajectory, Trajectory

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
