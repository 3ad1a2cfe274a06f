"""Your own mechanism: a scissor mast that opens in least time.

A mast of 6 scissors (pairs of crossed bars) is nearly folded: its bars stand 20 degrees steep. They
shall stand 60 degrees steep. A motor pulls the feet of the lowest scissor together with at most
900 N. It cannot push. The mast carries 2 kg at its top. Each bar is 0.5 m long and weighs 0.2 kg.

The first half of the script is a mechanism in the style of the package `models`: pure functions
that take the angle and give expressions, without solver or state. Inertia and potential energy
are all that Lagrange's equation of one degree of freedom needs,
I q'' + I' q'²/2 + V' = Q.
The second half states and solves the problem.

The optimum pulls with all it has, then not at all: gravity brakes. So the kinetic energy is known
along the way. With it the duration is an integral over the angle, which is a check without any
optimal control.
"""

from dataclasses import dataclass

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np

from ocp import Between, Control, Phase, Problem, State, solve

# --- the mechanism: symbols q [rad] angle of the bars, w [rad/s] its rate ---


@dataclass(frozen=True)
class Mast:
    """Scissor mast: `scissors` pairs of bars of `bar` [m], `bar_mass` [kg], `top_mass` [kg]."""

    scissors: int = 6
    bar: float = 0.5
    bar_mass: float = 0.2
    top_mass: float = 2.0
    gravity: float = 9.81


def height(mast: Mast, q: ca.SX) -> ca.SX:
    """Height of the top [m]."""
    return mast.scissors * mast.bar * ca.sin(q)


def width(mast: Mast, q: ca.SX) -> ca.SX:
    """Distance of the feet [m]."""
    return mast.bar * ca.cos(q)


def inertia(mast: Mast, q: ca.SX) -> ca.SX:
    """I(q) [kg m²]: the kinetic energy is I w²/2."""
    # the middle of scissor k rises as (k - 1/2) bar sin(q)
    turning = mast.bar_mass * mast.bar**2 / 12
    rises = [(k - 0.5) * mast.bar * ca.cos(q) for k in range(1, mast.scissors + 1)]
    bars = sum(2 * (turning + mast.bar_mass * rise**2) for rise in rises)
    return bars + mast.top_mass * (mast.scissors * mast.bar * ca.cos(q)) ** 2


def potential(mast: Mast, q: ca.SX) -> ca.SX:
    """V(q) [J]: weight of bars and top."""
    bars = 2 * mast.scissors * mast.bar_mass * height(mast, q) / 2
    return mast.gravity * (bars + mast.top_mass * height(mast, q))


def angular_acceleration(mast: Mast, q: ca.SX, w: ca.SX, pull: ca.SX) -> ca.SX:
    """Q'' [rad/s²] under the motor's pull [N] on the feet."""
    drive = -pull * ca.jacobian(width(mast, q), q)
    gyration = ca.jacobian(inertia(mast, q), q) * w**2 / 2
    return (drive - gyration - ca.jacobian(potential(mast, q), q)) / inertia(mast, q)


# --- the problem ---

mast = Mast()
START, END, MOST = np.radians(20.0), np.radians(60.0), 900.0
q = State("angle", "rad", lower=START, upper=END)
w = State("angular speed", "rad/s")
pull = Control("pull", "N", lower=0, upper=MOST)
opening = Phase(
    "opening",
    dynamics={q: w, w: angular_acceleration(mast, q.symbol, w.symbol, pull.symbol)},
    initial={q: START, w: 0},
    final={q: END, w: 0},
    end=Between(0.1, 10, guess=1),
)
solution = solve(Problem("mast", opening, minimise=opening.end_time))
duration = solution.value(opening.end_time)
print(f"duration {duration:.6f} s, {solution.verdict}")

times = np.linspace(0, duration, 401)
figure, panels = plt.subplots(2, 1, sharex=True, figsize=(6, 4), layout="constrained")
panels[0].plot(times, solution.sample(height(mast, q.symbol), times))
panels[0].set_ylabel("height [m]")
panels[1].plot(times, solution.sample(pull, times))
panels[1].set_ylabel("pull [N]")
panels[-1].set_xlabel("time [s]")
figure.savefig("scissor_mast.png", dpi=120)
