"""Fastest slide between two points without friction."""

import casadi as ca

from benchmarks.optima.benchmark import Benchmark
from ocp import Between, Constant, Control, Phase, Problem, State


def brachistochrone() -> Benchmark:
    """Least time along a curve under gravity.

    ``min t_f, x' = v sin(theta), y' = v cos(theta), v' = g cos(theta)``, from rest at (0, 0) to
    (2, 2) with the speed there free; g = 9.8 m/s^2.

    Optimum of the cycloid.  Source: V. M. Becerra, PSOPT, example "brac1" (0.824759143157).
    """
    distance = Constant("distance", "m", 2)
    x, y = State("x", "m", lower=0, upper=20), State("y", "m", lower=0, upper=20)
    v = State("v", "m/s", lower=0, upper=20)
    theta = Control("theta", "rad", lower=0, upper=2 * ca.pi)

    slide = Phase(
        "slide",
        {x: v * ca.sin(theta), y: v * ca.cos(theta), v: 9.8 * ca.cos(theta)},
        initial={x: 0, y: 0, v: 0},
        final={x: distance, y: 2},
        end=Between(0.1, 10, guess=2),
        guess={x: (0, 2), y: (0, 2), v: (0, 5), theta: 0.8},
    )

    return Benchmark(
        Problem("brachistochrone", (slide,), minimise=slide.end_time),
        optimum=0.8247591431566,
        tolerance=1e-8,
        source="PSOPT, example brac1; cycloid",
    )
