"""Fit of three rates of reaction to measured catalytic cracking of gas oil."""

from benchmarks.optima.benchmark import Benchmark
from ocp import Constant, Phase, Problem, State, Unknown

SAMPLES = (  # time, and the concentrations of gas oil and gasoline
    (0.0, 1.0, 0.0),
    (0.025, 0.8105, 0.2),
    (0.05, 0.6208, 0.2886),
    (0.075, 0.5258, 0.301),
    (0.1, 0.4345, 0.3215),
    (0.125, 0.3903, 0.3123),
    (0.15, 0.3342, 0.2716),
    (0.175, 0.3034, 0.2551),
    (0.2, 0.2735, 0.2258),
    (0.225, 0.2405, 0.1959),
    (0.25, 0.2283, 0.1789),
    (0.3, 0.2071, 0.1457),
    (0.35, 0.1669, 0.1198),
    (0.4, 0.153, 0.0909),
    (0.45, 0.1339, 0.0719),
    (0.5, 0.1265, 0.0561),
    (0.55, 0.12, 0.046),
    (0.65, 0.099, 0.028),
    (0.75, 0.087, 0.019),
    (0.85, 0.077, 0.014),
    (0.95, 0.069, 0.01),
)


def gas_oil() -> Benchmark:
    """Least sum of squared deviations from 21 samples of two concentrations.

    ``y1' = -(th1 + th3) y1^2, y2' = th1 y1^2 - th2 y2`` from (1, 0), th >= 0; the fitted rates
    are 11.84673838, 8.3445195, 1.00143997.

    Source: COPS 3.0 (2004), "gasoil" (5.2366e-3).
    """
    feed = Constant("feed", "1", 1)
    y1, y2 = State("y1"), State("y2")
    th1, th2, th3 = (Unknown(f"th{i}", lower=0, guess=5, scale=10) for i in (1, 2, 3))

    crack = Phase(
        "crack",
        {y1: -(th1 + th3) * y1.symbol**2, y2: th1 * y1.symbol**2 - th2 * y2},
        initial={y1: feed, y2: 0},
        end=SAMPLES[-1][0],
        guess={y1: (1, 0.07), y2: 0.1},
    )
    deviations = [
        crack.at(time, state) - measured
        for column, state in ((1, y1), (2, y2))
        for time, measured in ((sample[0], sample[column]) for sample in SAMPLES)
    ]

    return Benchmark(
        Problem("gas_oil", (crack,), minimise=sum(d**2 for d in deviations)),
        optimum=0.00523659583,
        tolerance=1e-5,
        source="COPS 3.0, gasoil (5.2366e-3); refined computation",
    )
