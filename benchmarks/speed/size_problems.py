"""Problems of any size: a heated rod of any number of states, a run of any number of phases."""

from __future__ import annotations

from itertools import pairwise

import casadi as ca
import numpy as np

from ocp import Between, Control, Phase, Problem, State, joined

CONDUCTIVITY = 1.0  # length^2 / s of a rod of length 1
TARGET, HOTTEST = 1.0, 1.2  # temperatures above the start
EFFORT = 1e-3  # weight of the heating's square
TURN = 1.0  # rad/s, at most, of a vehicle that drives 1 m/s
STEP, SIDE = 4.0, 1.0  # m from gate to gate, and to either side of the line


def heated_rod(states: int) -> Problem:
    """A rod that is heated at one end for 0.5 s, shall be warm everywhere, and nowhere too hot.

    The heat equation on cells of one width, after the method of lines.
    """
    width = 1.0 / states
    cells = [State(f"cell_{k}", upper=HOTTEST) for k in range(states)]
    heat = Control("heat", lower=0.0, upper=10.0)
    symbols = [cell.symbol for cell in cells]
    flows = [heat.symbol] + [
        CONDUCTIVITY * (left - right) / width for left, right in pairwise(symbols)
    ]
    flows.append(ca.SX(0.0))
    rates = {cell: (flows[k] - flows[k + 1]) / width for k, cell in enumerate(cells)}

    rod = Phase("rod", rates, initial=dict.fromkeys(cells, 0.0), end=0.5)
    misfit = sum((rod.at_end(cell) - TARGET) ** 2 for cell in cells) / states
    return Problem("heated rod", [rod], minimise=misfit + EFFORT * rod.integral(heat.symbol**2))


def slalom(phases: int) -> Problem:
    """A vehicle of constant speed through gates on alternate sides, in the least time.

    The turning rate is bounded, so that it switches in each phase.
    """
    x, y, heading = State("x", "m"), State("y", "m"), State("heading", "rad")
    turn = Control("turn", "rad/s", lower=-TURN, upper=TURN)
    rates = {x: ca.cos(heading.symbol), y: ca.sin(heading.symbol), heading: turn.symbol}
    gates = [(STEP * k, SIDE * (-1) ** k if 0 < k < phases else 0.0) for k in range(phases + 1)]
    legs = []
    for k, ((x0, y0), (x1, y1)) in enumerate(pairwise(gates)):
        begin, end = STEP * k, STEP * (k + 1)
        legs.append(
            Phase(
                f"leg {k + 1}",
                rates,
                initial={x: x0, y: y0, heading: 0.0} if k == 0 else {},
                final={x: x1, y: y1, **({heading: 0.0} if k == phases - 1 else {})},
                start=0.0 if k == 0 else Between(0.9 * begin, 2.0 * begin, guess=begin),
                end=Between(0.9 * end, 2.0 * end, guess=end),
                guess={
                    x: (x0, x1),
                    y: (y0, y1),
                    heading: float(np.arctan2(y1 - y0, x1 - x0)),
                    turn: 0.0,
                },
            )
        )
    links = [link for a, b in pairwise(legs) for link in joined(a, b)]
    return Problem("slalom", tuple(legs), minimise=legs[-1].end_time, links=links)
