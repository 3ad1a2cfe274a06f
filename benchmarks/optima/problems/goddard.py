"""Goddard's rocket: a singular arc of thrust, found in one phase or stated as one of three."""

import casadi as ca
import numpy as np

from benchmarks.optima.benchmark import Benchmark
from ocp import Between, Bound, Constant, Control, Phase, Problem, State, joined

QUICK = 0.2  # guess of the final time of the first problem


def goddard_vmax() -> Benchmark:
    """Greatest height under a cap on the speed, in one phase and in scaled units.

    ``max h(t_f), h' = v, v' = (T - 310 v^2 exp(-500 (h - 1))) / m - 1/h^2, m' = -2 T``,
    0 <= T <= 3.5, v <= 0.1, from (1, 0, 1) to m = 0.6: full thrust, a singular arc, an arc on the
    cap, coasting.

    Source: Bocop and CTDirect.jl, example "goddard" (1.01257); optimum from the four arcs as
    phases.
    """
    h, m = State("h", lower=1, upper=1.1), State("m", lower=0.6, upper=1)
    cap = Constant("speed cap", "1", 0.1)
    v, thrust = State("v", lower=0, upper=cap), Control("T", lower=0, upper=3.5)
    drag = 310 * v.symbol**2 * ca.exp(-500 * (h - 1))

    ascent = Phase(
        "ascent",
        {h: v, v: (thrust - drag) / m - 1 / h.symbol**2, m: -2 * thrust},
        initial={h: 1, v: 0, m: 1},
        final={m: 0.6},
        end=Between(0.02, 2, guess=QUICK),
        guess={
            h: (1, 1.01),
            v: lambda t: 0.4 * t / QUICK * (1 - t / QUICK),
            m: (1, 0.6),
            thrust: lambda t: 3.5 * np.exp(-6 * t / QUICK),
        },
    )

    return Benchmark(
        Problem("goddard_vmax", (ascent,), maximise=ascent.at_end(h)),
        optimum=1.01257632464,
        tolerance=1e-6,
        source="Bocop / CTDirect.jl, goddard (1.01257); four-phase solution",
    )


GRAVITY = 32.174  # [ft/s^2]
EXHAUST = 1580.9425279876559  # [ft/s]
MOST_THRUST = 193.044  # [lb]
DRAG = 5.49153484923381010e-5  # [slug/ft]
SCALE_HEIGHT = 23800.0  # [ft]


def goddard_betts() -> Benchmark:
    """Greatest height in three phases: full thrust, singular arc, coasting; ft, s, slug.

    On the singular arc ``m g = (1 + v/c) D``, at its entry too.

    Source: J. T. Betts, "Practical Methods for Optimal Control", sec. 4.14 (18550.872 ft);
    yapss's tests (18550.8718638 ft).  The phases end at 13.7512702, 21.9873626, 42.8878611 s.
    """
    h = State("h", "ft", lower=0, scale=1e4)
    v = State("v", "ft/s", lower=0, scale=1e3)
    # The mass never grows and ends at 1, so that it is never below. As a limit 1 would hold with
    # equality all along the coast: a region without interior, in which IPOPT wanders by rounding.
    m = State("m", "slug", lower=0.5, upper=3)
    most = Constant("most thrust", "lb", MOST_THRUST)
    thrust = Control("T", "lb", lower=0, upper=most, scale=100)
    drag = DRAG * v.symbol**2 * ca.exp(-h / SCALE_HEIGHT)
    singular = m * GRAVITY - (1 + v / EXHAUST) * drag

    def dynamics(force: ca.SX) -> dict[State, ca.SX]:
        return {h: v, v: (force - drag) / m - GRAVITY, m: -force / EXHAUST}

    boost = Phase(
        "boost",
        dynamics(most.symbol),
        initial={h: 0, v: 0, m: 3},
        end=Between(1, 45, guess=13.7),
        guess={h: (0, 4500), v: (0, 770), m: (3, 1.3)},
    )

    sustain = Phase(
        "sustain",
        dynamics(thrust.symbol),
        start=Between(1, 45, guess=13.7),
        end=Between(2, 45, guess=22),
        bounds=(Bound("singular arc", singular, "lb", 0, 0),),
        guess={h: (4500, 11000), v: (770, 800), m: (1.3, 1), thrust: 40},
    )

    coast = Phase(
        "coast",
        dynamics(ca.SX(0)),
        start=Between(2, 45, guess=22),
        end=Between(10, 100, guess=43),
        final={m: 1},
        guess={h: (11000, 18000), v: (800, 1), m: 1},
    )
    entry = Bound("entry of the singular arc", sustain.at_start(singular), "lb", 0, 0, scale=30)

    return Benchmark(
        Problem(
            "goddard_betts_3ph",
            (boost, sustain, coast),
            maximise=coast.at_end(h),
            bounds=(entry,),
            links=(*joined(boost, sustain), *joined(sustain, coast)),
        ),
        optimum=18550.8718635,
        tolerance=1e-8,
        source="Betts, sec. 4.14 (18550.872); yapss (18550.8718638)",
    )
