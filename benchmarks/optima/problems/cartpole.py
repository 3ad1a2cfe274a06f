"""Swing-up of a pole on a cart."""

import casadi as ca

from benchmarks.optima.benchmark import Benchmark
from ocp import Constant, Control, Phase, Problem, State


def cartpole() -> Benchmark:
    """Least squared force that swings the pole up while the cart moves 1 m in 2 s.

    ``min int_0^2 F^2 dt``, pole of length l = 0.5 m and mass m2 = 0.3 kg on a cart of
    m1 = 1 kg, g = 9.81 m/s^2; |F| <= 20 N and |q1| <= 2 m are inactive.

    Source: M. Kelly, "An Introduction to Trajectory Optimization", SIAM Review 59 (2017);
    optimum by collocation and, independently, by solving the boundary value problem of
    Pontryagin's principle.
    """
    l, m1, m2, g = 0.5, 1.0, 0.3, 9.81  # noqa: E741 - the paper's symbols
    distance = Constant("distance", "m", 1)
    q1, q2 = State("q1", "m", lower=-2, upper=2), State("q2", "rad")
    dq1, dq2 = State("dq1", "m/s"), State("dq2", "rad/s")
    F = Control("F", "N", lower=-20, upper=20, scale=10)
    sin, cos, spin = ca.sin(q2), ca.cos(q2), dq2.symbol**2

    swing = Phase(
        "swing",
        {
            q1: dq1,
            q2: dq2,
            dq1: (l * m2 * sin * spin + F + m2 * g * cos * sin) / (m1 + m2 * (1 - cos**2)),
            dq2: -(l * m2 * cos * sin * spin + F * cos + (m1 + m2) * g * sin)
            / (l * m1 + l * m2 * (1 - cos**2)),
        },
        initial={q1: 0, q2: 0, dq1: 0, dq2: 0},
        final={q1: distance, q2: ca.pi, dq1: 0, dq2: 0},
        end=2,
        guess={q1: (0, 1), q2: (0, ca.pi), dq1: 0, dq2: 0, F: 0},
    )

    return Benchmark(
        Problem("cartpole_kelly", (swing,), minimise=swing.integral(F.symbol**2, "effort")),
        optimum=58.8076674582,
        tolerance=1e-7,
        source="Kelly, SIAM Review 2017; collocation and Pontryagin boundary value problem",
    )
