"""Point masses on a line: position x [m], speed v [m/s], acceleration u or a [m/s^2].

All five have closed-form optima, written out beside each.
"""

import math

from benchmarks.optima.benchmark import Benchmark
from ocp import Between, Bound, Constant, Control, Phase, Problem, State, joined


def bryson_denham() -> Benchmark:
    """Least effort under a cap on the position.

    ``min 1/2 int_0^1 u^2 dt, x' = v, v' = u, x <= l, (x, v): (0, 1) -> (0, -1)``.

    Optimum ``4 / (9 l)`` for ``l <= 1/6``: here l = 1/9.  Source: A. E. Bryson, Y.-C. Ho,
    "Applied Optimal Control", 1975, p. 120; also BrysonDenham_F.m of the DT QP Project.
    """
    cap = Constant("l", "m", 1 / 9)
    x, v, u = State("x", "m", upper=cap), State("v", "m/s"), Control("u", "m/s^2")

    move = Phase(
        "move",
        {x: v, v: u},
        initial={x: 0, v: 1},
        final={x: 0, v: -1},
        guess={x: 0, v: (1, -1), u: 0},
        end=1.0,
    )

    return Benchmark(
        Problem("bryson_denham", (move,), minimise=move.integral(u.symbol**2 / 2, "effort")),
        optimum=4 / (9 * cap.value),
        tolerance=1e-6,
        source="Bryson & Ho, Applied Optimal Control, p. 120: 4/(9 l) for l <= 1/6",
    )


def di_min_time() -> Benchmark:
    """Least time between two points of rest.

    ``min t_f, x' = v, v' = u, -2 <= u <= 1, (0, 0) -> (300, 0)``; one switch, at t = 20 s.

    Optimum ``sqrt(2 D (1/a + 1/b))`` for a distance D, acceleration a and braking b.  Source:
    ICLOCS2, example "BangBang".
    """
    distance = Constant("distance", "m", 300)
    x, v = State("x", "m"), State("v", "m/s")
    u = Control("u", "m/s^2", lower=-2, upper=1)

    move = Phase(
        "move",
        {x: v, v: u},
        initial={x: 0, v: 0},
        final={x: distance, v: 0},
        end=Between(0.1, 100, guess=10),
        guess={x: (0, 300), v: 0, u: 0},
    )

    return Benchmark(
        Problem("di_min_time", (move,), minimise=move.end_time),
        optimum=math.sqrt(2 * distance.value * (1 / 1 + 1 / 2)),
        tolerance=1e-6,
        source="ICLOCS2, example BangBang: sqrt(2 D (1/a + 1/b))",
    )


def peak_accel() -> Benchmark:
    """Least peak acceleration between two points of rest in a given time.

    ``min max |u|, x' = v, v' = u, (0, 0) -> (D, 0)`` in T = 2 s with D = 3 m.

    Optimum ``4 D / T^2``: half the time full ahead, half full back.
    """
    distance, duration = Constant("distance", "m", 3), 2
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")

    move = Phase(
        "move",
        {x: v, v: u},
        initial={x: 0, v: 0},
        final={x: distance, v: 0},
        end=duration,
        guess={x: (0, distance.value), v: 0, u: 0},
    )
    highest = move.peak(u, name="acceleration", unit="m/s^2", absolute=True)

    return Benchmark(
        Problem("peak_accel", (move,), minimise=highest),
        optimum=4 * distance.value / duration**2,
        tolerance=1e-7,
        source="closed form 4 D/T^2",
    )


def peak_accel_jerk() -> Benchmark:
    """Least peak acceleration between two points of rest under a cap J on the jerk.

    ``min max |a|, x' = v, v' = a, a' = j, |j| <= J, (0, 0, 0) -> (D, 0, 0)`` in T = 2 s with
    D = 1 m, J = 6 m/s^3.

    Optimum ``J T / 4 (1 - sqrt(1 - 32 D / (J T^3)))``: two trapezoids of acceleration, one ahead
    and one back, whose flanks have the slope J.
    """
    distance, duration, cap = 1, 2, Constant("jerk cap", "m/s^3", 6)
    x, v, a = State("x", "m"), State("v", "m/s"), State("a", "m/s^2")
    j = Control("j", "m/s^3", lower=-cap, upper=cap)

    move = Phase(
        "move",
        {x: v, v: a, a: j},
        initial={x: 0, v: 0, a: 0},
        final={x: distance, v: 0, a: 0},
        end=duration,
        guess={x: (0, distance), v: 0, a: 0, j: 0},
    )
    highest = move.peak(a, name="acceleration", unit="m/s^2", absolute=True)
    root = math.sqrt(1 - 32 * distance / (cap.value * duration**3))

    return Benchmark(
        Problem("peak_accel_jerk", (move,), minimise=highest),
        optimum=cap.value * duration / 4 * (1 - root),
        tolerance=1e-5,
        source="closed form J T/4 (1 - sqrt(1 - 32 D/(J T^3)))",
    )


def via_point() -> Benchmark:
    """Least effort from rest through a point and back to rest, in two phases.

    ``min int u^2 dt, x' = v, v' = u, (0, 0) at 0 s -> x = 1 at 1 s -> (0, 0) at 3 s``, with
    position and speed continuous.

    Optimum 81/8, of the cubic spline through the three points with flat ends.
    """
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    through = Constant("through", "m", 1)

    there = Phase(
        "there",
        {x: v, v: u},
        initial={x: 0, v: 0},
        end=1,
        guess={x: (0, 0.5), v: (0, 1), u: 0},
    )

    back = Phase(
        "back",
        {x: v, v: u},
        final={x: 0, v: 0},
        start=1,
        end=3,
        guess={x: (0.5, 0), v: (1, 0), u: 0},
    )
    effort = there.integral(u.symbol**2, "effort there") + back.integral(u.symbol**2, "effort back")
    via = Bound("via point", there.at_end(x), "m", through, through)

    return Benchmark(
        Problem(
            "via_point",
            (there, back),
            minimise=effort,
            bounds=(via,),
            links=joined(there, back),
        ),
        optimum=81 / 8,
        tolerance=1e-9,
        source="closed form 81/8 of the cubic spline",
    )
