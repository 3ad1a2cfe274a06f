"""Re-entry of the space shuttle with the largest cross-range, in Betts's units: ft, s, rad."""

import math

import casadi as ca
import numpy as np

from benchmarks.optima.benchmark import Benchmark
from ocp import Between, Constant, Control, Phase, Problem, State

EARTH_RADIUS = 20902900.0  # [ft]
GRAVITATION = 0.14076539e17  # [ft^3/s^2]
MASS = 203000 / 32.174  # [slug]
WING = 2690.0  # [ft^2]
DURATION = 2000.0  # guess [s]


def shuttle() -> Benchmark:
    """Largest final latitude [deg], without a limit on heating.

    Source: J. T. Betts, "Practical Methods for Optimal Control", sec. 6.1 (0.59587608 rad at
    2008.5881 s); dymos (34.1412 deg at 2008.59 s); PSOPT (34.14120 deg).
    """
    deg = math.pi / 180
    mass = Constant("mass", "slug", MASS)
    h, v = State("h", "ft", lower=0, scale=1e5), State("v", "ft/s", lower=1, scale=1e4)
    longitude, heading = State("longitude", "rad"), State("heading", "rad")
    latitude = State("latitude", "rad", lower=-1.55, upper=1.55)
    path = State("path angle", "rad", lower=-1.55, upper=1.55)
    attack = Control("attack", "rad", lower=-90 * deg, upper=90 * deg)
    bank = Control("bank", "rad", lower=-90 * deg, upper=deg)

    r = EARTH_RADIUS + h
    g = GRAVITATION / r**2
    pressure = 0.5 * 0.002378 * ca.exp(-h / 23800) * v.symbol**2
    alpha = attack / deg
    drag = (0.07854 - 0.61592e-2 * alpha + 0.621408e-3 * alpha**2) * WING * pressure
    lift = (-0.20704 + 0.029244 * alpha) * WING * pressure
    turn = v / r * ca.cos(path) * ca.sin(heading) / ca.cos(latitude)

    entry = Phase(
        "entry",
        {
            h: v * ca.sin(path),
            longitude: turn,
            latitude: v / r * ca.cos(path) * ca.cos(heading),
            v: -drag / mass - g * ca.sin(path),
            path: lift / (mass * v) * ca.cos(bank) + ca.cos(path) * (v / r - g / v),
            heading: lift * ca.sin(bank) / (mass * v * ca.cos(path)) + turn * ca.sin(latitude),
        },
        initial={
            h: 260000,
            longitude: 0,
            latitude: 0,
            v: 25600,
            path: -deg,
            heading: 90 * deg,
        },
        final={h: 80000, v: 2500, path: -5 * deg},
        end=Between(500, 4000, guess=DURATION),
        guess={
            h: (260000, 80000),
            longitude: (0, 0.8),
            latitude: (0, 0.4),
            v: (25600, 2500),
            path: (-deg, -5 * deg),
            heading: (90 * deg, 0.2),
            attack: 17 * deg,
            bank: lambda t: -1.2 * (1 - np.asarray(t) / DURATION),
        },
    )

    return Benchmark(
        Problem("shuttle", (entry,), maximise=entry.at_end(latitude) / deg),
        optimum=34.14118428,
        tolerance=1e-7,
        source="Betts, sec. 6.1 (0.59587608 rad); dymos; PSOPT; refined computation",
    )
