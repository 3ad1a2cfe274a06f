"""The part "mpc": a cart-pole is swung up and held by repeated solves of one prepared problem.

Two programs do the same in one process, step by step in turn: `ocp.prepare`, and a program written
by hand in CasADi. Both use Radau collocation of degree 4 on the same mesh, piecewise constant
forces, the same options of IPOPT, and the unknowns and multipliers of the last step as the start.
Each drives a cart-pole of its own, which is simulated by the same Runge-Kutta steps. Seconds are of
the processor, of one step: new numbers in, first force out.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator
from time import process_time
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.parts import Measured, Setup
from studies.common.console import Table, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ocp.arrays import Array

Controller = Callable[["Array"], float]  # force [N] at a state

STEPS = 100
INTERVALS, DEGREE, HORIZON = 20, 4, 2.0  # of the prediction; [s]
STEP = HORIZON / INTERVALS  # that a force is held [s]
SUBSTEPS = 20  # of the simulation in a step
START = (0.0, math.pi, 0.0, 0.0)  # hanging
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
    from ocp import Constant, Control, FixedMesh, Phase, Problem, Radau, Settings, State, prepare

    position = State("position", "m", lower=-TRACK, upper=TRACK)
    angle, speed, turn = State("angle", "rad"), State("speed", "m/s"), State("turn rate", "rad/s")
    states = [position, angle, speed, turn]
    now = [Constant(f"{s.name} now", s.unit, at) for s, at in zip(states, START, strict=True)]
    force = Control("force", "N", lower=-STRONGEST, upper=STRONGEST, piecewise="constant")

    import casadi as ca

    phase = Phase(
        "prediction",
        dynamics=dict(zip(states, rates(ca, states, force), strict=True)),
        initial=dict(zip(states, now, strict=True)),
        end=HORIZON,
    )
    problem = Problem("cart-pole", phase, minimise=phase.integral(cost(states, force)))
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
    unknowns, rows, total = [ca.SX.sym("start", 4)], [], 0
    lower, upper = [np.full(4, -np.inf)], [np.full(4, np.inf)]
    rows.append(unknowns[0] - now)
    lower[0][0], upper[0][0] = -TRACK, TRACK
    left = unknowns[0]
    for k in range(INTERVALS):
        force, states = ca.SX.sym(f"force{k}"), ca.SX.sym(f"states{k}", 4, DEGREE)
        slopes = ca.mtimes(ca.horzcat(left, states), derivative)
        for j in range(DEGREE):
            rows.append(slopes[:, j] - STEP * ca.vertcat(*rates(ca, states[:, j], force)))
            total += STEP * weights[j] * cost(states[:, j], force)
        unknowns += [force, ca.vec(states)]
        position = np.zeros(4 * DEGREE, dtype=bool)
        position[::4] = True
        lower += [np.array([-STRONGEST]), np.where(position, -TRACK, -np.inf)]
        upper += [np.array([STRONGEST]), np.where(position, TRACK, np.inf)]
        left = states[:, -1]

    program = {"x": ca.vertcat(*unknowns), "p": now, "f": total, "g": ca.vertcat(*rows)}
    options = {f"ipopt.{name}": value for name, value in OPTIONS.items()}
    solver = ca.nlpsol("solver", "ipopt", program, {"print_time": False, **options})
    limits = {"lbx": np.concatenate(lower), "ubx": np.concatenate(upper), "lbg": 0, "ubg": 0}
    first = np.concatenate([START] + [[0.0, *START * DEGREE]] * INTERVALS)
    last = {"x": first, "lam_x": 0, "lam_g": 0}

    def control(state: Array) -> float:
        nonlocal last
        start = {"x0": last["x"], "lam_x0": last["lam_x"], "lam_g0": last["lam_g"]}
        last = solver(**start, **limits, p=state)
        return float(last["x"][4])

    return control
