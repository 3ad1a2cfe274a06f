"""The part "mpc": a cart-pole is swung up and held by repeated solves of one prepared problem.

Two controllers do this step by step in turn, in one process: `ocp.prepare`, and a program written
by hand in CasADi. Both use Radau collocation of degree 4 on the same mesh, piecewise constant
forces, the same options of IPOPT, and the unknowns and multipliers of the last step as the start.
Pushes keep the pole from coming to rest, where a controller has nothing to do. Each drives a
cart-pole of its own, which is simulated by the same Runge-Kutta steps. The seconds are processor
time of one step, from the measured state to the first force.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from time import process_time
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.parts import Measured, Setup
from studies.common.console import Table, number
from studies.common.exit_codes import StudyError

if TYPE_CHECKING:
    from ocp.arrays import Array

Controller = Callable[["Array"], float]  # force [N] at a state

STEPS = 100
INTERVALS, DEGREE, HORIZON = 20, 4, 2.0  # of the prediction; [s]
STEP = HORIZON / INTERVALS  # that a force is held [s]
SUBSTEPS = 20  # of the simulation in a step
PUSH, BETWEEN = 1.5, 25  # of the pole [rad/s], and steps from one to the next
START = (0.5, math.pi, 0.0, 0.0)  # hanging, off the middle, so that no mirrored motion is as good
CART, POLE, LENGTH, GRAVITY = 1.0, 0.3, 0.5, 9.81  # [kg, kg, m, m/s^2]
STRONGEST, TRACK = 20.0, 2.0  # limits of the force and of the position [N, m]
RATIO = 2.0  # of the medians, that is asked for
AGREEMENT = 1e-6  # of the two motions, all states [m, rad, m/s, rad/s]

# what `Ipopt()` gives for a start with multipliers, by IPOPT's own names
OPTIONS = {
    "sb": "yes",
    "print_level": 0,
    "tol": 1e-10,
    "constr_viol_tol": 1e-10,
    "dual_inf_tol": 1e-6,
    "compl_inf_tol": 1e-10,
    "mu_min": 1e-12,
    "acceptable_iter": 8,
    "acceptable_tol": 1e-8,
    "acceptable_constr_viol_tol": 1e-10,
    "acceptable_dual_inf_tol": 1e-6,
    "acceptable_compl_inf_tol": 1e-8,
    "max_iter": 1000,
    "linear_solver": "mumps",
    "mumps_pivtol": 1e-6,
    "mumps_mem_percent": 50,
    "mumps_scaling": 8,
    "mumps_pivot_order": 2,
    "mu_strategy": "adaptive",
    "bound_relax_factor": 0.0,
    "honor_original_bounds": "yes",
    "max_soc": 2,
    "warm_start_init_point": "yes",
    "perturb_dec_fact": 0.1,
    **dict.fromkeys(
        (
            "warm_start_bound_push",
            "warm_start_bound_frac",
            "warm_start_slack_bound_push",
            "warm_start_slack_bound_frac",
            "warm_start_mult_bound_push",
        ),
        1e-9,
    ),
}


def rates(lib: Any, state: Any, force: Any) -> list[Any]:
    """Rates of position, angle from upright, speed and turn rate; `lib` has sin and cos."""
    _, angle, speed, turn = (state[i] for i in range(4))
    sine, cosine = lib.sin(angle), lib.cos(angle)
    push = force + POLE * LENGTH * turn**2 * sine
    whole = CART + POLE * sine**2
    acceleration = (push - POLE * GRAVITY * sine * cosine) / whole
    return [speed, turn, acceleration, (GRAVITY * sine - acceleration * cosine) / LENGTH]


def cost(state: Any, force: Any) -> Any:
    """Running cost of a prediction."""
    position, angle, speed, turn = (state[i] for i in range(4))
    return position**2 + 5 * angle**2 + 0.1 * speed**2 + 0.1 * turn**2 + 0.01 * force**2


def prepared() -> Controller:
    """Controller of the engine: one prepared problem."""
    import casadi as ca

    from ocp import Constant, Control, FixedMesh, Phase, Problem, Radau, Settings, State, prepare

    position = State("position", "m", lower=-TRACK, upper=TRACK)
    angle, speed, turn = State("angle", "rad"), State("speed", "m/s"), State("turn rate", "rad/s")
    states = [position, angle, speed, turn]
    now = [Constant(f"{s.name} now", s.unit, at) for s, at in zip(states, START, strict=True)]
    force = Control("force", "N", lower=-STRONGEST, upper=STRONGEST, piecewise="constant")

    phase = Phase(
        "prediction",
        dynamics=dict(zip(states, rates(ca, states, force), strict=True)),
        initial=dict(zip(states, now, strict=True)),
        end=HORIZON,
    )
    problem = Problem("cart-pole", (phase,), minimise=phase.integral(cost(states, force)))
    settings = Settings(intervals=INTERVALS, scheme=Radau(DEGREE), refinement=FixedMesh())
    again, last = prepare(problem, settings=settings), None

    def control(state: Array) -> float:
        nonlocal last
        last = again.solve(constants=dict(zip(now, state.tolist(), strict=True)), guess=last)
        return float(last.sample(force, [0.0])[0])

    return control


def by_hand() -> Controller:
    """Controller of a program written by hand in CasADi, with the state now as its parameter."""
    import casadi as ca

    points = ca.collocation_points(DEGREE, "radau")
    derivative, _, weights = ca.collocation_coeff(points)
    now = ca.SX.sym("now", 4)
    left = ca.SX.sym("start", 4)
    unknowns, rows, total = [left], [left - now], 0
    for k in range(INTERVALS):
        force, states = ca.SX.sym(f"force{k}"), ca.SX.sym(f"states{k}", 4, DEGREE)
        slopes = ca.mtimes(ca.horzcat(left, states), derivative)
        for j in range(DEGREE):
            rows.append(slopes[:, j] - STEP * ca.vertcat(*rates(ca, states[:, j], force)))
            total += STEP * weights[j] * cost(states[:, j], force)
        unknowns += [force, ca.vec(states)]
        left = states[:, -1]

    program = {"x": ca.vertcat(*unknowns), "p": now, "f": total, "g": ca.vertcat(*rows)}
    options = {f"ipopt.{name}": value for name, value in OPTIONS.items()}
    solver = ca.nlpsol("solver", "ipopt", program, {"print_time": False, **options})
    of_state = (TRACK, math.inf, math.inf, math.inf)
    upper = np.concatenate([of_state, np.tile((STRONGEST, *of_state * DEGREE), INTERVALS)])
    limits = {"lbx": -upper, "ubx": upper, "lbg": 0, "ubg": 0}
    first = np.concatenate([START, np.tile((0.0, *START * DEGREE), INTERVALS)])
    last = {"x": first, "lam_x": 0, "lam_g": 0}

    def control(state: Array) -> float:
        nonlocal last
        start = {"x0": last["x"], "lam_x0": last["lam_x"], "lam_g0": last["lam_g"]}
        last = solver(**start, **limits, p=state)
        return float(last["x"][4])

    return control


CONTROLLERS: Mapping[str, Callable[[], Controller]] = {"prepared": prepared, "by hand": by_hand}


@dataclass(frozen=True, eq=False, repr=False)
class ClosedLoops:
    """What the controllers did, by their names.

    Attributes
    ----------
    seconds : mapping of str to (steps,)
        Processor time of each step [s].
    states : mapping of str to (steps, 4)
        After each step [m, rad, m/s, rad/s].
    """

    seconds: Mapping[str, Array]
    states: Mapping[str, Array]

    @property
    def apart(self) -> float:
        """Largest difference of two states [m, rad, m/s, rad/s]."""
        ours, other = self.states.values()
        return float(np.abs(ours - other).max())

    @property
    def ratio(self) -> float:
        """Of the medians of the seconds."""
        ours, other = (statistics.median(each) for each in self.seconds.values())
        return float(ours / other)


def closed_loops(steps: int) -> ClosedLoops:
    """Drive a cart-pole with each controller, in turn at every step.

    Raises
    ------
    StudyError
        If the two motions differ by more than `AGREEMENT`.
    """
    controllers = {name: make() for name, make in CONTROLLERS.items()}
    states = {name: [np.array(START)] for name in controllers}
    seconds: dict[str, list[float]] = {name: [] for name in controllers}
    for step in range(steps):
        pushed = np.array([0.0, 0.0, 0.0, PUSH if step % BETWEEN == BETWEEN - 1 else 0.0])
        for name, control in controllers.items():
            begin = process_time()
            force = control(states[name][-1])
            seconds[name].append(process_time() - begin)
            states[name].append(after_step(states[name][-1], force) + pushed)

    loops = ClosedLoops(
        {name: np.array(each) for name, each in seconds.items()},
        {name: np.array(each[1:]) for name, each in states.items()},
    )
    if not loops.apart <= AGREEMENT:  # nor if one is no number
        raise StudyError(f"the two motions of the cart-pole differ by {loops.apart:.1e}")
    return loops


def after_step(state: Array, force: float) -> Array:
    """The state (4,) after the force was held for a step: Runge and Kutta's method of order 4."""
    h = STEP / SUBSTEPS

    def slope(at: Array) -> Array:
        return np.array(rates(np, at, force))

    for _ in range(SUBSTEPS):
        a = slope(state)
        b = slope(state + h / 2 * a)
        c = slope(state + h / 2 * b)
        state = state + h / 6 * (a + 2 * b + 2 * c + slope(state + h * c))
    return state


def measure(setup: Setup) -> Iterator[Measured]:
    """Drive both for all steps; see `BenchmarkPart`."""
    loops = closed_loops(STEPS)
    seconds = {name: each.tolist() for name, each in loops.seconds.items()}
    setup.console.progress(f"mpc: {loops.ratio:.2f} of the program written by hand")
    yield {"seconds": seconds, "apart": loops.apart, "ratio": loops.ratio}


def tables(record: Measured) -> list[Table]:
    """Return medians and their ratio."""
    rows = [
        (name, number(1e3 * each[0], 3), number(1e3 * statistics.median(each), 3))
        for name, each in record["seconds"].items()
    ]
    notes = (
        f"the medians' ratio is {record['ratio']:.2f}; the target is {RATIO:g} at most",
        f"the two motions differ by {record['apart']:.1e} at most",
    )
    head = ("controller", "first step [ms]", "median [ms]")
    return [Table(f"A cart-pole controlled in {STEPS} steps", head, rows, notes)]
