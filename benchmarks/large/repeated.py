"""Large problems with as many signals as points, trays or links, and one of four like phases."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import root

from ocp import TIME, Between, Bound, Control, Phase, Problem, State, joined
from ocp.arrays import Array

POINTS = 20  # inside the rod
TRAYS = 32  # condenser and reboiler included
FEED, VOLATILITY, TRAY = 0.4, 1.6, 0.25
LINKS = 5


def heated_rod() -> Problem:
    """The heat equation on points in a row, warmed at both ends, above a moving limit."""
    width = math.pi / (POINTS + 1)
    inside = [State(f"y{i}") for i in range(1, POINTS + 1)]
    ends = [Control("u0"), Control("u1")]  # the temperatures beyond both ends
    row = [ends[0].symbol, *(y.symbol for y in inside), ends[1].symbol]
    wave = ca.sin(ca.pi * TIME.symbol / 5)

    heat = Phase(
        "heat",
        {y: (row[i - 1] - 2 * y + row[i + 1]) / width**2 for i, y in enumerate(inside, start=1)},
        initial=dict.fromkeys(inside, 0),
        end=5,
        bounds=[
            Bound(f"above {y.name}", y - (math.sin(i * width) * wave - 0.5 - 0.2), lower=0)
            for i, y in enumerate(inside, start=1)
        ],
        guess={**dict.fromkeys(inside, 0), **dict.fromkeys(ends, 0.1)},
    )
    squares, effort = (sum(s.symbol**2 for s in signals) for signals in (inside, ends))
    return Problem("heated rod", [heat], minimise=heat.integral(width * squares + 1e-3 * effort))


def distillation() -> Problem:
    """A column of two substances from one purity of its top product to another."""
    x = [State(f"x{i}", lower=0, upper=1) for i in range(1, TRAYS + 1)]
    reflux = Control("reflux", lower=1, upper=5)
    y = [VOLATILITY * tray / (1 + (VOLATILITY - 1) * tray) for tray in x]
    liquid = 0.2 * reflux
    vapour, below = liquid + 0.2, liquid + FEED

    # from the condenser at the top down to the reboiler
    rates = {x[0]: vapour * (y[1] - x[0]) / 0.5}
    for i in range(1, TRAYS - 1):
        at_feed = i == TRAYS // 2
        flow = liquid if i < TRAYS // 2 else below
        inflow = (
            FEED * 0.5 + liquid * x[i - 1] - below * x[i] if at_feed else flow * (x[i - 1] - x[i])
        )
        rates[x[i]] = (inflow - vapour * (y[i] - y[i + 1])) / TRAY
    rates[x[-1]] = below * x[-2] - (FEED - 0.2) * x[-1] - vapour * y[-1]

    first: dict[Any, float] = dict(zip(x, _steady_column(1.5), strict=True))
    step = Phase("step", rates, initial=first, end=60, guess={**first, reflux: 2})
    cost = step.integral(100 * (x[0] - 0.95) ** 2 + 1e-3 * (reflux - 3) ** 2)
    return Problem("distillation", [step], minimise=cost)


def _steady_column(reflux: float) -> list[float]:
    """Compositions of all stages at rest, to four digits: where no flow changes them."""
    liquid = 0.2 * reflux
    vapour, below = liquid + 0.2, liquid + FEED
    at_feed = TRAYS // 2
    downwards = np.where(np.arange(1, TRAYS - 1) < at_feed, liquid, below)

    def flows(x: Array) -> Array:
        y = VOLATILITY * x / (1 + (VOLATILITY - 1) * x)
        inflow = downwards * (x[:-2] - x[1:-1])
        inflow[at_feed - 1] = FEED * 0.5 + liquid * x[at_feed - 1] - below * x[at_feed]
        condenser = vapour * (y[1] - x[0])
        reboiler = below * x[-2] - (FEED - 0.2) * x[-1] - vapour * y[-1]
        return np.concatenate([[condenser], inflow - vapour * (y[1:-1] - y[2:]), [reboiler]])

    found = root(flows, np.linspace(0.95, 0.05, TRAYS), tol=1e-12)
    return [float(f"{v:.4g}") for v in found.x]


def arm() -> Problem:
    """A planar arm of equal links, lifted from hanging to level; its equations of motion are rows.

    Angles q are absolute. Each link of length 0.4 m carries a mass of 1 kg at its end. Torques act
    between neighbours. Accelerations are controls that the equations determine.
    """
    length, gravity, most = 0.4, 9.81, (90.0, 60.0, 40.0, 20.0, 8.0)
    links = range(LINKS)
    q, w = ([State(f"{name}{i + 1}") for i in links] for name in "qw")
    a = [Control(f"a{i + 1}", scale=10) for i in links]
    tau = [Control(f"tau{i + 1}", lower=-m, upper=m, scale=m) for i, m in enumerate(most)]

    rows = []
    for i in links:
        row = (LINKS - i) * gravity * length * ca.sin(q[i]) - tau[i]
        for j in links:
            turned, mass = q[i] - q[j], (LINKS - max(i, j)) * length**2
            row += mass * (ca.cos(turned) * a[j] + ca.sin(turned) * w[j].symbol ** 2)
        row += tau[i + 1] if i + 1 < LINKS else 0
        rows.append(Bound(f"link {i + 1}", row, lower=0, upper=0, scale=most[i]))

    rest = dict.fromkeys(w, 0)
    lift = Phase(
        "lift",
        {**dict(zip(q, w, strict=True)), **dict(zip(w, a, strict=True))},
        initial={**dict.fromkeys(q, 0), **rest},
        final={**dict.fromkeys(q, math.pi / 2), **rest},
        end=2,
        bounds=rows,
        guess={**dict.fromkeys(q, (0, math.pi / 2)), **dict.fromkeys([*w, *a, *tau], 0)},
    )
    effort = sum((torque / m) ** 2 for torque, m in zip(tau, most, strict=True))
    return Problem("five-link arm", [lift], minimise=lift.integral(effort))


# The launch in units of the earth's radius of 6378145 m and of 806.81187 s, in which its gravity is
# 1, and in kg: thrust and flow of one booster, of the first and of the second stage
_BOOSTER, _FIRST, _SECOND = (
    (64143.914, 182498.271),
    (110539.814, 295367.336),
    (11236.0542, 19386.5367),
)
_PER_SECOND = 1 / 806.8118744  # of a second
_EARTH_RATE = 0.05883365657577035
_PLACE = (0.8788171126619654, 0.0, 0.4771587602596084)
_INSERTION = ((0.689, 0.665, 0.373), (-0.956, 0.847, 0.256))  # position and speed at the perigee


def launch() -> Problem:
    """A launcher with nine boosters, of which six and then three burn; four phases.

    All engines are at full thrust, so that masses are known functions of time. The direction of
    thrust is a vector of length 1 at most. The orbit is given by its angular momentum and by two
    components of its vector of eccentricity.
    """
    burn_first = 95550 * 75.2 / 261
    masses = [301454.0]
    masses.append(masses[0] - 6 * 17010 - burn_first - 6 * 2280)
    masses.append(masses[1] - 3 * 17010 - burn_first - 3 * 2280)
    masses.append(4164.0 + 19300.0)
    times = [t * _PER_SECOND for t in (0.0, 75.2, 150.4, 261.0, 961.0)]

    states = [State(name, scale=1.0) for name in ("x", "y", "z", "vx", "vy", "vz")]
    aim = [Control(name, scale=1.0) for name in ("ux", "uy", "uz")]
    x, y, z, vx, vy, vz = (state.symbol for state in states)
    place, speed = ca.vertcat(x, y, z), ca.vertcat(vx, vy, vz)
    r = ca.norm_2(place)
    direction = ca.vertcat(*(u.symbol for u in aim))
    start, last = (*_PLACE, 0.0, _EARTH_RATE * _PLACE[0], 0.0), (*_INSERTION[0], *_INSERTION[1])

    phases = []
    for k, (name, boosters) in enumerate({"six": 6, "three": 3, "first": 0, "second": 0}.items()):
        stage = _FIRST if k < 3 else _SECOND
        thrust, flow = (own + boosters * one for own, one in zip(stage, _BOOSTER, strict=True))
        mass = masses[k] - flow * (TIME.symbol - times[k])
        wind = speed + _EARTH_RATE * ca.vertcat(y, -x, 0)
        # the air stands still at the start: its speed needs a slope there
        air = ca.sqrt(ca.sumsqr(wind) + 1e-8)
        drag = 24545978.5 * ca.exp(-(r - 1) / 0.001128854863) * air / mass
        turned = -place / r**3 + thrust / mass * direction - drag * wind

        # a straight line through all phases, lifted off the ground: else it leads through the earth
        lift = (1.08,) * 3 + (1.0,) * 3
        line = {
            state: tuple(
                lift[i] * (start[i] + (last[i] - start[i]) * times[j] / times[-1])
                for j in (k, k + 1)
            )
            for i, state in enumerate(states)
        }
        phases.append(
            Phase(
                name,
                dict(zip(states, [vx, vy, vz, *ca.vertsplit(turned)], strict=True)),
                initial=dict(zip(states, start, strict=True)) if k == 0 else {},
                start=times[k],
                end=times[k + 1] if k < 3 else Between(0.5, times[-1], guess=times[-1]),
                bounds=[
                    Bound("direction", ca.sumsqr(direction), upper=1),
                    Bound("height", r, lower=0.999),
                ],
                guess={**line, **dict(zip(aim, (0, 1, 0), strict=True))},
            )
        )

    # the orbit's angular momentum, and two components of its vector of eccentricity
    h = ca.cross(place, speed)
    orbit = ca.vertsplit(ca.vertcat(h, (ca.cross(speed, h) - place / r)[:2]))
    wanted = (
        *(-0.6365358031704023, 0.00222193813898483, 1.1723602526170225),
        *(0.4900165280229769, 0.47290903795636496),
    )
    second = phases[-1]
    rows = [
        Bound(f"orbit {i}", second.at_end(expression), lower=value, upper=value)
        for i, (expression, value) in enumerate(zip(orbit, wanted, strict=True), start=1)
    ]
    links = [link for one, other in pairwise(phases) for link in joined(one, other)]
    return Problem("launch", phases, minimise=second.end_time, bounds=rows, links=links)
