"""IPOPT, with typed settings and failures told apart."""

from __future__ import annotations

import logging
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.errors import StatementError
from ocp.nlp.interrupts import Interrupts, noted_interrupts
from ocp.transcription.kernels import Program

Array = NDArray[np.float64]
Outcome = Literal[
    "solved", "infeasible", "unbounded", "overdetermined", "budget", "invalid number",
    "interrupted", "failed",
]  # fmt: skip
LinearSolver = Literal["mumps", "spral", "ma27", "ma57", "ma77", "ma86", "ma97", "pardiso"]
Barrier = Literal["monotone", "adaptive"]
LineSearch = Literal["filter", "cg-penalty"]
log = logging.getLogger(__name__)

_OUTCOMES: dict[str, Outcome] = {
    "Solve_Succeeded": "solved",
    "Solved_To_Acceptable_Level": "solved",
    "Feasible_Point_Found": "solved",
    "Infeasible_Problem_Detected": "infeasible",
    "Diverging_Iterates": "unbounded",
    "Not_Enough_Degrees_Of_Freedom": "overdetermined",
    "Maximum_Iterations_Exceeded": "budget",
    "Maximum_CpuTime_Exceeded": "budget",
    "Maximum_WallTime_Exceeded": "budget",
    "Invalid_Number_Detected": "invalid number",
    "User_Requested_Stop": "interrupted",
    "Restoration_Failed": "infeasible",
}

# A start that is optimal for nearby numbers: leave it where it is, and let the quality function
# choose the barrier.  Tried on the benchmark problems with a number 5 % higher: larger pushes (to
# 1e-3) help a bang-bang problem or two and cost others half of what is saved; centred starts and a
# monotone barrier cost more throughout.  Curvature added once is dropped quickly: near a solution,
# on a singular arc above all, it is what slows the last steps down.
_WARM = {
    "ipopt.warm_start_init_point": "yes",
    "ipopt.mu_strategy": "adaptive",
    "ipopt.perturb_dec_fact": 0.1,
    **{f"ipopt.warm_start_{what}": 1e-9 for what in (
        "bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push",
    )},
}  # fmt: skip


@dataclass(frozen=True)
class IpoptOptions:
    """The choices left to the user; see IPOPT's manual for their meaning.

    Attributes
    ----------
    tolerance : of the scaled optimality conditions; a stall within a factor 100 of it is accepted.
    dual_tolerance : of the optimality conditions before IPOPT divides them by the size of the
        multipliers; rounding sets its floor where these are large, as in stiff dynamics.
    constraint_violation : of the scaled constraints.
    complementarity : largest product of a limit's slack and its multiplier, scaled.
    max_iterations, seconds : budget of one run.
    linear_solver : MUMPS is always there; an HSL routine (ma27 to ma97) or pardiso needs its
        library.
    stall : iterations within a factor 100 of the tolerance that end the run; 0 for never.
    line_search : what makes a step acceptable, a filter or the penalty function of Chen and
        Goldfarb; near a degenerate optimum the one may wander for long where the other ends soon.
    pivot_tolerance : of MUMPS; raise it, say to 0.01, for stiff dynamics: with too small pivots
        the curvature is misjudged and the steps become short.
    """

    tolerance: float = 1e-10
    dual_tolerance: float = 1e-6
    constraint_violation: float = 1e-10
    complementarity: float = 1e-10
    max_iterations: int = 1000
    seconds: float = 1e6
    linear_solver: LinearSolver = "mumps"
    barrier: Barrier = "adaptive"
    line_search: LineSearch = "filter"
    print_level: int = 0
    pivot_tolerance: float = 1e-6
    stall: int = 8

    def loosened(self, tolerance: float) -> IpoptOptions:
        """No tolerance below the given one, and no stall accepted above it."""
        if tolerance <= self.tolerance:
            return self
        return replace(
            self, tolerance=tolerance, stall=0,
            dual_tolerance=max(self.dual_tolerance, 10.0 * tolerance),
            constraint_violation=max(self.constraint_violation, tolerance),
            complementarity=max(self.complementarity, tolerance),
        )  # fmt: skip

    def __post_init__(self) -> None:
        for what, value, known in (
            ("linear solver", self.linear_solver, get_args(LinearSolver)),
            ("barrier", self.barrier, get_args(Barrier)),
            ("line search", self.line_search, get_args(LineSearch)),
        ):
            if value not in known:
                raise StatementError(f"the {what} is {value!r}; choose one of {', '.join(known)}")


@dataclass(frozen=True, eq=False)
class NlpResult:
    """What a run of a solver left behind.

    Attributes
    ----------
    x : (n,) scaled unknowns.
    bound_multipliers : (n,), row_multipliers : (m,) in CasADi's sign, ``L = f + lam^T g``.
    solver : the one that ran.
    """

    outcome: Outcome
    status: str
    x: Array
    objective: float
    rows: Array
    bound_multipliers: Array
    row_multipliers: Array
    iterations: int
    seconds: float
    solver: str = "ipopt"


@dataclass(frozen=True, eq=False)
class Duals:
    """Multipliers to start from, scaled and in CasADi's sign, ``L = f + lam^T g``.

    Attributes
    ----------
    columns : (n,) of the bounds of the unknowns.
    rows : (m,) of the rows.
    """

    columns: Array
    rows: Array


Listener = Callable[[int, float, Array, Array], bool]


class _Watch(ca.Callback):
    """Called at every iteration: stops when the user asks to, else passes it to a listener."""

    def __init__(self, program: Program, interrupts: Interrupts, listener: Listener | None) -> None:
        ca.Callback.__init__(self)
        self.program, self.interrupts, self.listener = program, interrupts, listener
        self.count = 0
        self.error: BaseException | None = None
        self.construct("watch", {})

    def get_n_in(self) -> int:
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> Any:
        sizes = {
            "x": self.program.variables, "f": 1, "g": self.program.rows,
            "lam_x": self.program.variables, "lam_g": self.program.rows,
            "lam_p": self.program.constants,
        }  # fmt: skip
        return ca.Sparsity.dense(sizes[ca.nlpsol_out(i)], 1)

    def eval(self, arg: Any) -> list[float]:
        stop = False
        try:
            if self.listener is not None:
                x, f, g = (np.array(arg[i]).ravel() for i in range(3))
                stop = self.listener(self.count, float(f[0]), x, g)
        except BaseException as error:
            self.error, stop = error, True
        self.count += 1
        return [1.0 if stop or self.interrupts.asked else 0.0]


def _settings(program: Program, options: IpoptOptions) -> dict[str, Any]:
    """CasADi's and IPOPT's own options."""
    mumps = options.linear_solver == "mumps"
    return {
        "grad_f": program.objective_gradient,
        "jac_g": program.constraint_jacobian,
        "hess_lag": program.lagrangian_hessian,
        "print_time": False,
        "calc_lam_p": False,
        "no_nlp_grad": True,  # built for multipliers of parameters alone, dearer than the rest
        "show_eval_warnings": False,
        "ipopt.sb": "yes",
        "ipopt.print_level": options.print_level,
        "ipopt.tol": options.tolerance,
        "ipopt.constr_viol_tol": options.constraint_violation,
        "ipopt.dual_inf_tol": options.dual_tolerance,
        # a limit that acts at many points has small multipliers there; what the barrier leaves of
        # it, mu over the multiplier, is ripple, the more the finer the mesh
        "ipopt.mu_min": min(1e-12, 1e-2 * options.tolerance),
        "ipopt.compl_inf_tol": options.complementarity,
        # progress can stall just above the tolerance where an optimum is flat
        "ipopt.acceptable_iter": options.stall,
        "ipopt.acceptable_tol": 100.0 * options.tolerance,
        "ipopt.acceptable_constr_viol_tol": options.constraint_violation,
        "ipopt.acceptable_dual_inf_tol": options.dual_tolerance,
        "ipopt.acceptable_compl_inf_tol": 1e-8,
        "ipopt.max_iter": options.max_iterations,
        "ipopt.max_wall_time": options.seconds,
        "ipopt.linear_solver": options.linear_solver,
        # minimum degree that sets dense rows apart: a peak, a free time or a parameter touches
        # every interval, and the default ordering becomes slower and slower per interval
        "ipopt.mumps_pivot_order": 6,
        "ipopt.mu_strategy": options.barrier,
        "ipopt.line_search_method": options.line_search,
        # bounds are caps that engineers state: not relaxed by the default 1e-8
        "ipopt.bound_relax_factor": 0.0,
        "ipopt.honor_original_bounds": "yes",
        "ipopt.max_soc": 2,
    } | ({"ipopt.mumps_pivtol": options.pivot_tolerance} if mumps else {})


def run(
    program: Program,
    x0: Array,
    column_limits: tuple[Array, Array],
    row_limits: tuple[Array, Array],
    constants: Array,
    options: IpoptOptions,
    listener: Listener | None = None,
    multipliers: Duals | None = None,
) -> NlpResult:
    """Run IPOPT from `x0`; never raises for a failed solve, the outcome tells.

    With `multipliers` the start is taken as it is, close to the bounds that are active, see
    `_WARM`.

    Raises
    ------
    StatementError
        There is no such linear solver here.
    """
    begin = clock.perf_counter()
    with noted_interrupts() as interrupts:
        watch = _Watch(program, interrupts, listener)
        settings = {**_settings(program, options), "iteration_callback": watch}
        start = {}
        if multipliers is not None:
            settings |= _WARM
            start = {"lam_x0": multipliers.columns, "lam_g0": multipliers.rows}
        solver = ca.nlpsol("solver", "ipopt", program.oracle, settings)
        result = solver(
            x0=x0, p=constants, lbx=column_limits[0], ubx=column_limits[1],
            lbg=row_limits[0], ubg=row_limits[1], **start,
        )  # fmt: skip
    if watch.error is not None:
        raise watch.error
    stats = solver.stats()
    status = str(stats["return_status"])
    if status == "Invalid_Option":  # all others are typed: the library cannot be loaded
        raise StatementError(
            f"IPOPT finds no library with the linear solver '{options.linear_solver}' here; "
            "install it where the system looks for libraries, or choose mumps"
        )
    log.debug("IPOPT: %s after %d iterations", status, stats["iter_count"])

    def vector(key: str) -> Array:
        return np.array(result[key]).ravel()

    return NlpResult(
        outcome="interrupted" if interrupts.asked else _OUTCOMES.get(status, "failed"),
        status=status, x=vector("x"),
        objective=float(result["f"]), rows=vector("g"), bound_multipliers=vector("lam_x"),
        row_multipliers=vector("lam_g"), iterations=int(stats["iter_count"]),
        seconds=clock.perf_counter() - begin,
    )  # fmt: skip
