"""Problems with time scales far shorter than the horizon."""

import casadi as ca

from benchmarks.optima.benchmark import Benchmark
from ocp import TIME, Bound, Constant, Control, Phase, Problem, State


def hypersensitive() -> Benchmark:
    """Boundary layers at both ends of a long rest.

    ``min 1/2 int_0^50 x^2 + u^2 dt, x' = -x^3 + u, x: 1.5 -> 1``.

    Optimum from the closed form of the infinite horizon, which at 50 s differs by less than
    1e-20.  Source: A. V. Rao, K. D. Mease, Optim. Control Appl. Meth. 21 (2000); PSOPT, example
    "hypersensitive" (1.330826, of low accuracy).
    """
    first = Constant("first", "1", 1.5)
    x, u = State("x", lower=-50, upper=50), Control("u", lower=-50, upper=50)

    run = Phase(
        "run",
        {x: -(x.symbol**3) + u},
        initial={x: first},
        final={x: 1},
        end=50,
        guess={x: 0.5, u: 0},
    )
    cost = run.integral((x.symbol**2 + u.symbol**2) / 2, "cost")

    return Benchmark(
        Problem("hypersensitive_50", (run,), minimise=cost),
        optimum=1.330806904943,
        tolerance=1e-6,
        source="Rao & Mease 2000; closed form of the infinite horizon",
    )


def alp_rider() -> Benchmark:
    """A stiff linear system that must keep above four peaks of terrain.

    ``min int_0^20 100 |y|^2 + 0.01 |u|^2 dt`` with ``|y|^2`` at least the sum of four bells in
    time, ``(2, 1, 2, 1) -> (2, 3, 1, -2)``.

    Source: J. T. Betts, "Practical Methods for Optimal Control", example "alpr01" (2030.85609);
    PSOPT, example "alpine".  A circulating script with -2 u2 in y2' is another problem (1558).
    """
    first = Constant("first", "1", 2)
    y1, y2, y3, y4 = (State(f"y{i}") for i in (1, 2, 3, 4))
    u1, u2 = (Control(f"u{i}", lower=-500, upper=500, scale=10) for i in (1, 2))
    t = TIME.symbol
    norm = ca.sumsqr(ca.vertcat(y1.symbol, y2.symbol, y3.symbol, y4.symbol))
    bells = ((3, 12, 3), (3, 10, 6), (3, 6, 10), (8, 4, 15))
    terrain = sum(height * ca.exp(-rate * (t - at) ** 2) for height, rate, at in bells)

    ride = Phase(
        "ride",
        {
            y1: -10 * y1 + u1 + u2,
            y2: -2 * y2 + u1 + 2 * u2,
            y3: -3 * y3 + 5 * y4 + u1 - u2,
            y4: 5 * y3 - 3 * y4 + u1 + 3 * u2,
        },
        initial={y1: first, y2: 1, y3: 2, y4: 1},
        final={y1: 2, y2: 3, y3: 1, y4: -2},
        end=20,
        bounds=(Bound("above the terrain", norm - terrain - 0.01, lower=0),),
        guess={y1: (2, 2), y2: (1, 3), y3: (2, 1), y4: (1, -2), u1: 0, u2: 0},
    )
    cost = ride.integral(100 * norm + 0.01 * (u1.symbol**2 + u2.symbol**2), "cost")

    return Benchmark(
        Problem("alp_rider", (ride,), minimise=cost),
        optimum=2030.8545,
        tolerance=2e-6,
        source="Betts, alpr01 (2030.85609); PSOPT, example alpine",
    )
