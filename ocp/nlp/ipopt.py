"""IPOPT, with typed options and failures told apart."""

from __future__ import annotations

import logging
import math
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Integral
from typing import Any, Literal, get_args

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.errors import StatementError
from ocp.keywords import as_written, checked_keywords
from ocp.nlp.interrupts import noted_interrupts
from ocp.nlp.kept import kept_solver
from ocp.nlp.solver import LEAST_SECONDS, Listener, NlpResult, Outcome, StartingPoint
from ocp.transcription.kernels import Program
from ocp.transcription.transcribe import ProgramLimits

LinearSolver = Literal["mumps", "spral", "ma27", "ma57", "ma77", "ma86", "ma97", "pardiso"]
Barrier = Literal["monotone", "adaptive"]
LineSearch = Literal["filter", "cg-penalty"]
log = logging.getLogger(__name__)

# Part of unknowns that ran away, by which a row may be off from rounding
_MISSED = 1e-3

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

# A start that is optimal for nearby numbers is left where it is, and the quality function chooses
# the barrier. Tried on the benchmark problems with a number 5 % higher: larger pushes (to 1e-3)
# help a bang-bang problem or two and cost others half of what is saved. Centred starts and a
# monotone barrier cost more throughout.
_PUSH = 1e-9
_WARM_START = {
    "ipopt.warm_start_init_point": "yes",
    "ipopt.mu_strategy": "adaptive",
    # Curvature added once is dropped quickly. Near a solution, on a singular arc above all, it is
    # what slows the last steps down.
    "ipopt.perturb_dec_fact": 0.1,
    "ipopt.warm_start_bound_push": _PUSH,
    "ipopt.warm_start_bound_frac": _PUSH,
    "ipopt.warm_start_slack_bound_push": _PUSH,
    "ipopt.warm_start_slack_bound_frac": _PUSH,
    "ipopt.warm_start_mult_bound_push": _PUSH,
}

# IPOPT's names of the options that have a field here
_FIELDS = {
    "tol": "tolerance",
    "dual_inf_tol": "dual_tolerance",
    "constr_viol_tol": "constraint_violation",
    "compl_inf_tol": "complementarity",
    "max_iter": "max_iterations",
    "max_wall_time": "seconds",
    "linear_solver": "linear_solver",
    "mu_strategy": "barrier",
    "line_search_method": "line_search",
    "print_level": "print_level",
    "mumps_pivtol": "pivot_tolerance",
    "acceptable_iter": "stall",
}

# CasADi's own: nothing that nobody reads
_CASADI: dict[str, Any] = {
    "print_time": False,
    "calc_lam_p": False,
    # built for multipliers of parameters alone, dearer than the rest
    "no_nlp_grad": True,
    "show_eval_warnings": False,
}

_TOLERANCES = ("tolerance", "dual_tolerance", "constraint_violation", "complementarity", "gap")

# status of a run that left all motions behind
_DIVERGED = "Diverged"

# Orderings of MUMPS. Where a few states are used on hundreds of intervals, approximate minimum
# degree leaves far less to factorize than minimum fill. On small programs the two take the same,
# and after minimum fill fewer starts from multipliers need added curvature. A peak, a free time or
# a parameter touches every interval: minimum degree that sets such dense rows apart stays linear in
# the intervals, and is dearer until there are thousands.
_MINIMUM_DEGREE, _MINIMUM_FILL, _DENSE_ROWS_APART = 0, 2, 6
_LARGE = 5_000  # unknowns
_DENSE = 10_000  # uses of one unknown

# Per cent of memory beyond what MUMPS expects. IPOPT's own 1000 is given back to the system and
# fetched anew for each matrix. Where it is too little IPOPT raises it.
_SPARE_MEMORY = 50

# Rounding allows no less complementarity, and the barrier goes no lower than a tenth of this.
_LEAST_COMPLEMENTARITY = 1e-11

# Building the functions counts from this part of the seconds on: with the same options an IPOPT
# object is kept.
_HARDLY_ANY = 0.01

# Progress can stall just above the tolerance where an optimum is flat.
_STALL_FACTOR = 100.0


@checked_keywords()
@dataclass(frozen=True, repr=False)
class Ipopt:
    """IPOPT, with the options left to the user; see its manual for their meaning.

    Parameters
    ----------
    tolerance : float
        Of the scaled optimality conditions. A stall within a factor 100 of it is accepted.
    dual_tolerance : float
        Of the optimality conditions before IPOPT divides them by the size of the multipliers.
        Rounding sets its floor where these are large, as in stiff dynamics.
    constraint_violation : float
        Of the scaled constraints. A stall within a factor 100 of it is accepted, too.
    complementarity : float
        Largest product of a limit's slack and its multiplier, scaled.
    gap : float
        Largest sum of these products: the distance of the scaled objective from its optimum. It
        is not met with more than about ten thousand limits, where each product would have to be
        below 1e-11. A refinement lowers it to a tenth of the tolerance on the objective.
    max_iterations : int
        Of one run.
    seconds : float
        Of one run [s].
    linear_solver : str
        MUMPS is always there. An HSL routine (ma27 to ma97) or pardiso needs its library. Its
        dense blocks get one thread, or as many as OPENBLAS_NUM_THREADS of the environment says.
    barrier : str
        How the barrier goes down, "adaptive" or "monotone".
    line_search : str
        What makes a step acceptable: a filter, or the penalty function of Chen and Goldfarb. Near a
        degenerate optimum the one may wander for long where the other ends soon.
    print_level : int
        How much IPOPT prints, 0 for nothing.
    pivot_tolerance : float
        Of MUMPS. Raise it, say to 0.01, for stiff dynamics: with too small pivots the curvature is
        misjudged and the steps become short.
    stall : int
        Iterations within a factor 100 of the tolerance that end the run, 0 for never.
    options : mapping of str to number or str
        Further options by the names of IPOPT's manual, such as ``{"max_soc": 4}``. They replace the
        values that this class chooses.

    Raises
    ------
    StatementError
        If IPOPT does not have a choice or an option, a number makes no sense, or an option has a
        field of its own.
    """

    tolerance: float = 1e-10
    dual_tolerance: float = 1e-6
    constraint_violation: float = tolerance
    complementarity: float = tolerance
    gap: float = math.inf
    max_iterations: int = 1000
    seconds: float = 1e6
    linear_solver: LinearSolver = "mumps"
    barrier: Barrier = "adaptive"
    line_search: LineSearch = "filter"
    print_level: int = 0
    pivot_tolerance: float = 1e-6
    stall: int = 8
    options: Mapping[str, float | str] = field(default_factory=dict, hash=False)

    def __repr__(self) -> str:
        return as_written(self)

    def __post_init__(self) -> None:
        for what, value, known in (
            ("linear solver", self.linear_solver, get_args(LinearSolver)),
            ("barrier", self.barrier, get_args(Barrier)),
            ("line search", self.line_search, get_args(LineSearch)),
        ):
            if value not in known:
                raise StatementError(f"the {what} is {value!r}; choose one of {', '.join(known)}")

        for name in _TOLERANCES:
            number = getattr(self, name)
            if not (isinstance(number, (int, float)) and number > 0):
                raise StatementError(f"IPOPT's {name} is {number!r}; give a positive number")
        for name in ("max_iterations", "stall"):
            if not isinstance(getattr(self, name), Integral):
                raise StatementError(
                    f"IPOPT's {name} is {getattr(self, name)!r}; give a whole number"
                )
        self._check_options()

    def _check_options(self) -> None:
        """StatementError unless IPOPT takes all further options, and none has a field here."""
        for name, value in self.options.items():
            if name in _FIELDS:
                raise StatementError(
                    f"IPOPT's option '{name}' is a field; write Ipopt({_FIELDS[name]}={value!r})"
                )
            x = ca.SX.sym("x")
            try:
                ca.nlpsol("check", "ipopt", {"x": x}, {**_CASADI, f"ipopt.{name}": value})
            except (RuntimeError, NotImplementedError, TypeError) as error:
                raise StatementError(
                    f"IPOPT does not accept the option {name}={value!r}; see the list of options "
                    "in its manual"
                ) from error

    def within(self, iterations: float, seconds: float) -> Ipopt:
        """The same options with a budget of one run that is not above the given one."""
        if iterations >= self.max_iterations and seconds >= self.seconds:
            return self
        return replace(
            self,
            max_iterations=int(min(self.max_iterations, iterations)),
            seconds=min(self.seconds, seconds),
        )

    def loosened(self, tolerance: float) -> Ipopt:
        """No tolerance below the given one, and no stall accepted above it."""
        if tolerance <= self.tolerance:
            return self
        return replace(
            self,
            tolerance=tolerance,
            stall=0,
            dual_tolerance=max(self.dual_tolerance, 10.0 * tolerance),
            constraint_violation=max(self.constraint_violation, tolerance),
            complementarity=max(self.complementarity, tolerance),
        )

    def within_gap(self, gap: float) -> Ipopt:
        """The same options, ending at most this far above the least scaled objective."""
        return self if gap >= self.gap else replace(self, gap=gap)

    def alternatives(self, *, warm: bool) -> Sequence[Ipopt]:
        """Another line search from multipliers, a barrier that strays less without them."""
        if warm:
            return (replace(self, line_search="cg-penalty"),)
        return (replace(self, barrier="monotone"),)

    def solve(
        self,
        program: Program,
        start: StartingPoint,
        limits: ProgramLimits,
        parameters: Array,
        listener: Listener | None = None,
    ) -> NlpResult:
        """Run IPOPT; never raises for a failed solve, the outcome tells.

        With multipliers the start is taken as it is, close to the bounds that are active.

        Raises
        ------
        StatementError
            There is no such linear solver here.
        """
        begin = clock.perf_counter()
        program.prepare()
        options = self._options(program, limits, building=clock.perf_counter() - begin)
        multipliers: dict[str, Array] = {}
        if start.multipliers is not None:
            options |= _WARM_START
            multipliers = dict(zip(("lam_x0", "lam_g0"), start.multipliers, strict=True))
        options |= {f"ipopt.{name}": value for name, value in self.options.items()}

        with noted_interrupts() as interrupts, kept_solver(program, options) as kept:
            with kept.watch.over(interrupts, listener):
                solution = kept.run(
                    x0=start.x,
                    **multipliers,
                    p=parameters,
                    lbx=limits.columns[0],
                    ubx=limits.columns[1],
                    lbg=limits.rows[0],
                    ubg=limits.rows[1],
                )
            statistics = kept.statistics()

        status, count = str(statistics["return_status"]), int(statistics["iter_count"])
        if status == "Invalid_Option":
            # all other options are typed: the library cannot be loaded
            raise StatementError(
                f"IPOPT finds no library with the linear solver '{self.linear_solver}'; install it "
                "in the library path of the system, or choose mumps"
            )
        log.debug("IPOPT: %s after %d iterations", status, count)
        if _OUTCOMES.get(status) == "unbounded" and _is_no_motion(solution, limits):
            status = _DIVERGED

        # a run that never began has none
        steps = statistics.get("iterations", {})
        moved = len(steps.get("d_norm", ())) > 1
        return NlpResult(
            outcome="interrupted" if interrupts.asked else _OUTCOMES.get(status, "failed"),
            status=status,
            x=_within(solution["x"], limits),
            objective=float(solution["f"][0]),
            rows=solution["g"],
            bound_multipliers=solution["lam_x"],
            row_multipliers=solution["lam_g"],
            iterations=count,
            seconds=clock.perf_counter() - begin,
            added_curvature=float(steps["regularization_size"][-1]) if moved else math.nan,
            last_step=float(steps["d_norm"][-1]) if moved else math.nan,
        )

    def _options(
        self, program: Program, limits: ProgramLimits, *, building: float
    ) -> dict[str, Any]:
        """All options for a program whose functions took some seconds to build [s]."""
        seconds = self.seconds
        if building > _HARDLY_ANY * seconds:
            seconds = max(seconds - building, LEAST_SECONDS)
        # the barrier makes all products equal, so that those of thousands of limits add up
        complementarity = min(self.complementarity, self.gap / max(limits.sides, 1))
        least = min(self.complementarity, _LEAST_COMPLEMENTARITY)
        options = _CASADI | {
            "ipopt.sb": "yes",
            "ipopt.print_level": self.print_level,
            "ipopt.tol": self.tolerance,
            "ipopt.constr_viol_tol": self.constraint_violation,
            "ipopt.dual_inf_tol": self.dual_tolerance,
            # A limit that acts at many points has small multipliers there. What the barrier leaves
            # of it, mu over the multiplier, is ripple, the more the finer the mesh.
            "ipopt.mu_min": min(1e-12, 1e-2 * self.tolerance),
            "ipopt.compl_inf_tol": max(complementarity, least),
            "ipopt.acceptable_iter": self.stall,
            "ipopt.acceptable_tol": _STALL_FACTOR * self.tolerance,
            # rows of fast rates are met no better than to their round-off
            "ipopt.acceptable_constr_viol_tol": _STALL_FACTOR * self.constraint_violation,
            "ipopt.acceptable_dual_inf_tol": self.dual_tolerance,
            # IPOPT's own 1e-2 would accept limits that are not met
            "ipopt.acceptable_compl_inf_tol": 1e-8,
            "ipopt.max_iter": self.max_iterations,
            "ipopt.max_wall_time": seconds,
            "ipopt.linear_solver": self.linear_solver,
            "ipopt.mu_strategy": self.barrier,
            "ipopt.line_search_method": self.line_search,
            # Bounds are caps that engineers state: not relaxed by the default 1e-8.
            "ipopt.bound_relax_factor": 0.0,
            "ipopt.honor_original_bounds": "yes",
            # half of IPOPT's second-order corrections: each costs the rows and a back-substitution
            "ipopt.max_soc": 2,
        }

        if self.linear_solver == "mumps":
            options["ipopt.mumps_pivot_order"] = _ordering(program)
            options["ipopt.mumps_pivtol"] = self.pivot_tolerance
            options["ipopt.mumps_mem_percent"] = _SPARE_MEMORY
            # Rows and columns by turns until all are of size 1, each matrix anew. What MUMPS
            # chooses by itself made factors six times as dear where a limit acts nearly everywhere.
            options["ipopt.mumps_scaling"] = 8
        return options


def _ordering(program: Program) -> int:
    """Which ordering MUMPS is asked for, by the size and the most frequent unknown of a program."""
    if program.most_uses > _DENSE:
        return _DENSE_ROWS_APART
    return _MINIMUM_DEGREE if program.variables > _LARGE else _MINIMUM_FILL


def _is_no_motion(solution: Mapping[str, Array], limits: ProgramLimits) -> bool:
    """Whether unknowns that ran away miss rows by as much: that says nothing of the objective."""
    missed = float(limits.excess(solution["g"]).max(initial=0.0))
    return missed > _MISSED * float(np.abs(solution["x"]).max(initial=0.0))


def _within(x: Array, limits: ProgramLimits) -> Array:
    """Unknowns that are nowhere beyond their limits.

    Where a slack vanishes in rounding, because its multiplier is large, IPOPT moves the limit by
    2e-12 (its option `slack_move`) and leaves it there. Times a multiplier of 1e6 this is more than
    a certificate takes for complementary.
    """
    lower, upper = limits.columns
    return np.minimum(np.maximum(x, lower), upper)
