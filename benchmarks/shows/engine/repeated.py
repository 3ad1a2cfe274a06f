"""Large problems, among them those with as many signals as trays or links.

Each function of these returns what a table of `problems/large.toml` would, written out.
"""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
from scipy.optimize import root

from benchmarks.shows.engine.variant import Variant
from ocp.arrays import Array

POINTS = 20  # inside the rod
TRAYS = 32  # condenser and reboiler included
LINKS = 5


def heated_rod() -> dict[str, Any]:
    """The heat equation on points in a row, warmed at both ends, above a moving limit."""
    width = math.pi / (POINTS + 1)
    states, rates, path, squares = {}, {}, [], []

    # the controls are the temperatures beyond both ends
    for i in range(1, POINTS + 1):
        left = f"y{i - 1}" if i > 1 else "u0"
        right = f"y{i + 1}" if i < POINTS else "u1"
        states[f"y{i}"] = {"first": 0, "guess": "0"}
        rates[f"y{i}"] = f"({left} - 2*y{i} + {right})/{width**2!r}"
        limit = f"({math.sin(i * width)!r}*sin(pi*t/5) - 0.5) - 0.2"
        path.append({"expression": f"y{i} - ({limit})", "lower": 0})
        squares.append(f"y{i}**2")

    cost = f"{width!r}*({' + '.join(squares)}) + 1e-3*(u0**2 + u1**2)"
    return {
        "source": "J. T. Betts, S. L. Campbell, Discretize then optimize, in Mathematics in "
        "Industry, SIAM 2005: heat equation with limits of the state; twenty points here",
        "objective": "cost",
        "phases": [
            {
                "name": "heat",
                "end": 5,
                "states": states,
                "controls": {"u0": {"guess": "0.1"}, "u1": {"guess": "0.1"}},
                "rates": rates,
                "integrals": {"cost": cost},
                "path": path,
            }
        ],
    }


def distillation() -> dict[str, Any]:
    """A column of two substances from one purity of its top product to another."""
    feed, volatility, tray = 0.4, 1.6, 0.25
    at_feed = TRAYS // 2 + 1
    names = {
        f"y{i}": f"{volatility}*x{i}/(1 + {volatility - 1!r}*x{i})" for i in range(1, TRAYS + 1)
    }
    let = {"liquid": "reflux*0.2", "vapour": "liquid + 0.2", "below": f"liquid + {feed}", **names}

    # from the condenser at the top down to the reboiler
    rates = {"x1": "vapour*(y2 - x1)/0.5"}
    for i in range(2, TRAYS):
        flow = "liquid" if i < at_feed else "below"
        inflow = f"{flow}*(x{i - 1} - x{i})"
        if i == at_feed:
            inflow = f"{feed}*0.5 + liquid*x{i - 1} - below*x{i}"
        rates[f"x{i}"] = f"({inflow} - vapour*(y{i} - y{i + 1}))/{tray}"
    last = TRAYS
    rates[f"x{last}"] = f"below*x{last - 1} - {feed - 0.2!r}*x{last} - vapour*y{last}"

    states = {
        f"x{i}": {"lower": 0, "upper": 1, "first": x, "guess": repr(x)}
        for i, x in enumerate(_steady_column(1.5), start=1)
    }
    return {
        "source": "binary distillation column of J. D. Hedengren (nonlinear model library, "
        "column with 32 stages), after J. Hahn, T. F. Edgar, Computers and Chemical Engineering "
        "26 (2002); from memory",
        "objective": "cost",
        "phases": [
            {
                "name": "step",
                "end": 60,
                "states": states,
                "controls": {"reflux": {"lower": 1, "upper": 5, "guess": "2"}},
                "let": let,
                "rates": rates,
                "integrals": {"cost": "100*(x1 - 0.95)**2 + 1e-3*(reflux - 3)**2"},
            }
        ],
    }


def _steady_column(reflux: float) -> list[float]:
    """Compositions of all stages at rest, to four digits: where no flow changes them."""
    feed, volatility = 0.4, 1.6
    liquid = 0.2 * reflux
    vapour, below = liquid + 0.2, liquid + feed
    at_feed = TRAYS // 2
    downwards = np.where(np.arange(1, TRAYS - 1) < at_feed, liquid, below)

    def flows(x: Array) -> Array:
        y = volatility * x / (1 + (volatility - 1) * x)
        inflow = downwards * (x[:-2] - x[1:-1])
        inflow[at_feed - 1] = feed * 0.5 + liquid * x[at_feed - 1] - below * x[at_feed]
        condenser = vapour * (y[1] - x[0])
        reboiler = below * x[-2] - (feed - 0.2) * x[-1] - vapour * y[-1]
        return np.concatenate([[condenser], inflow - vapour * (y[1:-1] - y[2:]), [reboiler]])

    found = root(flows, np.linspace(0.95, 0.05, TRAYS), tol=1e-12)
    return [float(f"{v:.4g}") for v in found.x]


def arm() -> dict[str, Any]:
    """A planar arm of equal links, lifted from hanging to level; its equations of motion are rows.

    Angles q are absolute. Each link of length 0.4 m carries a mass of 1 kg at its end. Torques act
    between neighbours. Accelerations are controls that the equations determine.
    """
    length, gravity = 0.4, 9.81
    states: dict[str, Any] = {}
    controls: dict[str, Any] = {}
    rates: dict[str, str] = {}
    path: list[dict[str, Any]] = []
    for i in range(1, LINKS + 1):
        states[f"q{i}"] = {"first": 0, "last": "pi/2"}
        states[f"w{i}"] = {"first": 0, "last": 0}
        controls[f"a{i}"] = {"scale": 10}
        controls[f"tau{i}"] = {"lower": -_torque(i), "upper": _torque(i), "scale": _torque(i)}
        rates |= {f"q{i}": f"w{i}", f"w{i}": f"a{i}"}

        beyond = LINKS + 1 - i  # masses that the link carries
        terms = [f"{beyond * gravity * length!r}*sin(q{i})"]
        for j in range(1, LINKS + 1):
            mass = (LINKS + 1 - max(i, j)) * length**2
            terms.append(f"{mass!r}*(cos(q{i} - q{j})*a{j} + sin(q{i} - q{j})*w{j}**2)")
        terms.append(f"-tau{i}" + (f" + tau{i + 1}" if i < LINKS else ""))
        path.append({"expression": " + ".join(terms), "lower": 0, "upper": 0, "scale": _torque(i)})
    effort = " + ".join(f"(tau{i}/{_torque(i)})**2" for i in range(1, LINKS + 1))
    return {
        "source": "a chain of rigid links, equations as in R. M. Murray, Z. Li, S. S. Sastry, A "
        "Mathematical Introduction to Robotic Manipulation, ch. 4; numbers chosen here",
        "objective": "effort",
        "phases": [
            {
                "name": "lift",
                "end": 2,
                "states": states,
                "controls": controls,
                "rates": rates,
                "integrals": {"effort": effort},
                "path": path,
            }
        ],
    }


def _torque(i: int) -> float:
    """Largest torque at the foot of a link [Nm]."""
    return float((90, 60, 40, 20, 8)[i - 1])


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


def launch() -> dict[str, Any]:
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

    phases = []
    for k, boosters in enumerate((6, 3, 0, 0)):
        stage = _FIRST if k < 3 else _SECOND
        thrust = stage[0] + boosters * _BOOSTER[0]
        flow = stage[1] + boosters * _BOOSTER[1]
        phases.append(_burn(k, times, masses[k], thrust, flow))

    # the orbit's angular momentum, and two components of its vector of eccentricity
    h = ("y*vz - z*vy", "z*vx - x*vz", "x*vy - y*vx")
    momentum = (-0.6365358031704023, 0.00222193813898483, 1.1723602526170225)
    radius = "sqrt(x**2 + y**2 + z**2)"
    eccentricity = (
        (f"vy*({h[2]}) - vz*({h[1]}) - x/{radius}", 0.4900165280229769),
        (f"vz*({h[0]}) - vx*({h[2]}) - y/{radius}", 0.47290903795636496),
    )
    rows = [*zip(h, momentum, strict=True), *eccentricity]
    return {
        "source": "D. A. Benson, A Gauss pseudospectral transcription for optimal control, MIT "
        "2005, ch. 7: Delta III, 7529.71 kg into orbit, so 924.14 s or 1.145421; from memory",
        "objective": "second_t_f",
        "rows": [{"expression": _at_end(e), "lower": v, "upper": v} for e, v in rows],
        "phases": phases,
    }


def _at_end(expression: str) -> str:
    """An expression of states at the end of the last phase."""
    return re.sub(r"\b(v?[xyz])\b", r"second_\1_f", expression)


def _burn(k: int, times: list[float], mass: float, thrust: float, flow: float) -> dict[str, Any]:
    """One phase of the launch."""
    states: dict[str, Any] = {}
    start = (*_PLACE, 0.0, _EARTH_RATE * _PLACE[0], 0.0)
    line = [times[k] / times[-1], (times[k + 1] - times[k]) / times[-1]]
    for i, name in enumerate(("x", "y", "z", "vx", "vy", "vz")):
        last = (*_INSERTION[0], *_INSERTION[1])[i]
        lift = 1.08 if i < 3 else 1.0  # else the straight line leads through the earth
        guess = f"{lift}*({start[i]!r} + ({last - start[i]!r})*({line[0]!r} + {line[1]!r}*s))"
        states[name] = {"guess": guess, "scale": 1.0} | ({"first": start[i]} if k == 0 else {})
    phase: dict[str, Any] = {
        "name": ("six", "three", "first", "second")[k],
        "start": times[k],
        "end": times[k + 1] if k < 3 else [0.5, times[-1], times[-1]],
        "states": states,
        "controls": {
            "ux": {"guess": "0", "scale": 1.0},
            "uy": {"guess": "1", "scale": 1.0},
            "uz": {"guess": "0", "scale": 1.0},
        },
        "let": {
            "mass": f"{mass!r} - {flow!r}*(t - {times[k]!r})",
            "push": f"{thrust!r}/mass",
            "r": "sqrt(x**2 + y**2 + z**2)",
            "ax": f"vx + {_EARTH_RATE}*y",
            "ay": f"vy - {_EARTH_RATE}*x",
            # the air stands still at the start: its speed needs a slope there
            "air": "sqrt(ax**2 + ay**2 + vz**2 + 1e-8)",
            "drag": "24545978.5*exp(-(r - 1)/0.001128854863)*air/mass",
        },
        "rates": {
            "x": "vx",
            "y": "vy",
            "z": "vz",
            "vx": "-x/r**3 + push*ux - drag*ax",
            "vy": "-y/r**3 + push*uy - drag*ay",
            "vz": "-z/r**3 + push*uz - drag*vz",
        },
        "path": [
            {"expression": "ux**2 + uy**2 + uz**2", "upper": 1},
            {"expression": "r", "lower": 0.999},
        ],
    }
    return phase


REPEATED = {
    "heated_rod": heated_rod,
    "distillation": distillation,
    "five_link_arm": arm,
    "launch": launch,
}


def large(name: str) -> Variant:
    """A large problem, of the file or of this module, with its own numbers."""
    if name in REPEATED:
        return Variant(name, REPEATED[name](), {})
    return Variant.nominal(name, "large")
