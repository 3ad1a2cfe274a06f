"""Optimal control by direct collocation on CasADi and IPOPT.

State a problem with `State`, `Control`, `Phase` and `Problem`, hand it to `solve`, and read the
`Solution`, which has been refined, replayed by another integrator and checked between its points.

The packages, from the lowest to the highest: `numerics` (schemes, polynomials, integrators),
`problem` (what the user states), `mesh` (meshes, trajectories, guesses), `reformulate` (what is
solved in place of a statement), `scaling` (typical sizes), `transcription` (the nonlinear program),
`nlp` (its solvers), `optimality` (costates, multipliers, the Hamiltonian), `estimates` (errors
between the points), `verification` (replay), `refinement` (the next mesh), `diagnostics` (the
certificate), `solution` (what is returned, stored and drawn) and `analysis` (questions that take
more than one solve). `algorithm` leads from a problem to its solution.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ocp.accuracy import Accuracy
from ocp.errors import (
    BudgetSpent,
    Collapsed,
    FamilyStopped,
    FileError,
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
from ocp.mesh.mesh import Mesh, PhaseMesh
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.nlp.interrupts import noted_interrupts
from ocp.numerics.schemes import Gauss, HermiteSimpson, Lobatto, Radau, Trapezoid
from ocp.problem.bounds import Bound
from ocp.problem.functionals import Functional
from ocp.problem.interpolants import Interpolant
from ocp.problem.phase import Phase, joined, peak
from ocp.problem.problem import Problem, with_objective
from ocp.problem.symbols import (
    TIME,
    Algebraic,
    Between,
    ByFraction,
    Constant,
    Control,
    State,
    Unknown,
)

if TYPE_CHECKING:
    from ocp.algorithm import solve
    from ocp.analysis.correction import Corrected, corrected
    from ocp.analysis.family import Family, Member, family
    from ocp.analysis.front.both_ways import front_between
    from ocp.analysis.front.continuation import FrontPoint, FrontSubject, FrontWay, PointNotFound
    from ocp.analysis.front.envelope import ParetoFront
    from ocp.analysis.front.neighbours import NeighbourSolver
    from ocp.analysis.front.pareto import front
    from ocp.analysis.homotopy import Homotopy, homotopy
    from ocp.analysis.lexicographic import Lexicographic, PriorityLevel, solve_lexicographic
    from ocp.analysis.multistart import Audit, audit
    from ocp.analysis.optima import Optimum, Trial
    from ocp.analysis.parametric import Prepared, prepare
    from ocp.analysis.relaxation import Relaxation, Relaxed, relaxed
    from ocp.analysis.scaling_report import scaling_report
    from ocp.analysis.sensitivity import ActiveSetWarning, Sided, slopes_by_multipliers
    from ocp.diagnostics.certificate import STANDARD, Certificate, certify
    from ocp.diagnostics.diagnostic import Diagnostic, Evidence, Finding, Tolerances
    from ocp.diagnostics.second_solve import confirm
    from ocp.nlp.ipopt import Ipopt
    from ocp.nlp.solver import NlpResult, NlpSolver
    from ocp.refinement.policies.adaptive_mesh import AdaptiveMesh
    from ocp.refinement.policies.moving_mesh import MovingMesh, coarsened
    from ocp.refinement.policies.policy import FixedMesh, MeshPolicy
    from ocp.refinement.solved_mesh import MeshIteration
    from ocp.reformulate.reformulation import Reformulation, Restated
    from ocp.settings import Settings
    from ocp.solution.solution import Solution
    from ocp.solution.storage import load, save
    from ocp.verification.verify import Verification

# What states a problem is loaded now, and all else when it is first asked for: a program that only
# states problems, or asks for help, need not wait for it. It saves a third of the time.
_LATER = {
    "algorithm": ("solve",),
    "analysis.correction": ("Corrected", "corrected"),
    "analysis.family": ("Family", "Member", "family"),
    "analysis.front.both_ways": ("front_between",),
    "analysis.front.continuation": ("FrontPoint", "FrontSubject", "FrontWay", "PointNotFound"),
    "analysis.front.envelope": ("ParetoFront",),
    "analysis.front.neighbours": ("NeighbourSolver",),
    "analysis.front.pareto": ("front",),
    "analysis.homotopy": ("Homotopy", "homotopy"),
    "analysis.lexicographic": ("Lexicographic", "PriorityLevel", "solve_lexicographic"),
    "analysis.optima": ("Optimum", "Trial"),
    "analysis.parametric": ("Prepared", "prepare"),
    "analysis.relaxation": ("Relaxation", "Relaxed", "relaxed"),
    "analysis.scaling_report": ("scaling_report",),
    "analysis.sensitivity": ("ActiveSetWarning", "Sided", "slopes_by_multipliers"),
    "analysis.multistart": ("Audit", "audit"),
    "refinement.policies.moving_mesh": ("MovingMesh", "coarsened"),
    "nlp.ipopt": ("Ipopt",),
    "nlp.solver": ("NlpResult", "NlpSolver"),
    "refinement.solved_mesh": ("MeshIteration",),
    "refinement.policies.adaptive_mesh": ("AdaptiveMesh",),
    "refinement.policies.policy": ("FixedMesh", "MeshPolicy"),
    "reformulate.reformulation": ("Reformulation", "Restated"),
    "settings": ("Settings",),
    "solution.solution": ("Solution",),
    "solution.storage": ("load", "save"),
    "diagnostics.certificate": ("STANDARD", "Certificate", "certify"),
    "diagnostics.diagnostic": ("Diagnostic", "Evidence", "Finding", "Tolerances"),
    "diagnostics.second_solve": ("confirm",),
    "verification.verify": ("Verification",),
}
_MODULES = {name: module for module, names in _LATER.items() for name in names}

__all__ = [
    "STANDARD",
    "TIME",
    "Accuracy",
    "ActiveSetWarning",
    "AdaptiveMesh",
    "Algebraic",
    "Audit",
    "Between",
    "Bound",
    "BudgetSpent",
    "ByFraction",
    "Certificate",
    "Collapsed",
    "Constant",
    "Control",
    "Corrected",
    "Diagnostic",
    "Evidence",
    "Family",
    "FamilyStopped",
    "FileError",
    "Finding",
    "FixedMesh",
    "FrontPoint",
    "FrontSubject",
    "FrontWay",
    "Functional",
    "Gauss",
    "HermiteSimpson",
    "Homotopy",
    "HomotopyStopped",
    "Infeasible",
    "Interpolant",
    "Interrupted",
    "InvalidNumber",
    "Ipopt",
    "IterationLimit",
    "Lexicographic",
    "Lobatto",
    "Member",
    "Mesh",
    "MeshIteration",
    "MeshPolicy",
    "MovingMesh",
    "NeighbourSolver",
    "NlpResult",
    "NlpSolver",
    "NumericalTrouble",
    "OcpError",
    "Optimum",
    "Overdetermined",
    "ParetoFront",
    "Phase",
    "PhaseMesh",
    "PhaseTrajectory",
    "PointNotFound",
    "Prepared",
    "PriorityLevel",
    "Problem",
    "Radau",
    "Reformulation",
    "Relaxation",
    "Relaxed",
    "Restated",
    "Settings",
    "Sided",
    "Solution",
    "SolveFailed",
    "State",
    "StatementError",
    "StatementWarning",
    "Tolerances",
    "Trajectory",
    "Trapezoid",
    "Trial",
    "Unbounded",
    "Unknown",
    "Unverified",
    "Verification",
    "audit",
    "certify",
    "coarsened",
    "confirm",
    "corrected",
    "family",
    "front",
    "front_between",
    "homotopy",
    "joined",
    "load",
    "noted_interrupts",
    "peak",
    "prepare",
    "relaxed",
    "save",
    "scaling_report",
    "slopes_by_multipliers",
    "solve",
    "solve_lexicographic",
    "with_objective",
]


def __getattr__(name: str) -> Any:
    """A name whose module is loaded on first use."""
    if name in _MODULES:
        value = globals()[name] = getattr(import_module(f"ocp.{_MODULES[name]}"), name)
        return value
    if name == "__version__":
        from importlib.metadata import version  # reads a file, which an import need not wait for

        return version("antenna-ocp")
    raise AttributeError(f"module 'ocp' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
