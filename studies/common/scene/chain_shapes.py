"""The shape of a chain of links over time, as series of a result: what moves in a report.

The series run along `shape/time`. Link k (from 1) has the places `shape/LINK/NODE_x` and `_y` of
its nodes (from 0), and `shape/LINK/heading`, the direction in which it leaves its joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ocp.arrays import Array
from studies.common.result import Result, Series

if TYPE_CHECKING:
    from models.ancf.integrate.simulate import Simulation

HEAD = "shape/"
TIME = f"{HEAD}time"
INSTANTS = 241  # of a motion: a picture for each third of a second of a slow one is enough


@dataclass(frozen=True, eq=False)
class ChainShapes:
    """A chain at several instants.

    Attributes
    ----------
    times : (m,) [s].
    nodes : of each link, (m, nodes, 2) [m].
    headings : of each link at its joint, (m,) [rad].
    """

    times: Array
    nodes: tuple[Array, ...]
    headings: tuple[Array, ...]

    def straight(self) -> tuple[Array, ...]:
        """The links without their bending, (m, nodes, 2) [m] each.

        A link starts where the straight one before it ends, and keeps its heading and length.
        """
        start, links = self.nodes[0][:, 0], []
        for nodes, heading in zip(self.nodes, self.headings, strict=True):
            steps = np.linalg.norm(np.diff(nodes, axis=1), axis=2)
            along = np.insert(np.cumsum(steps, axis=1), 0, 0.0, axis=1)
            axis = np.stack([np.cos(heading), np.sin(heading)], axis=1)
            links.append(start[:, None] + along[:, :, None] * axis[:, None])
            start = links[-1][:, -1]
        return tuple(links)


def shape_series(runs: Sequence[Simulation], instants: int = INSTANTS) -> dict[str, Series]:
    """The series of a motion that was simulated in one run or, with a lock, in several.

    Parameters
    ----------
    runs : of the same chain, one after the other.
    instants : at most so many are kept, the first and the last of each run among them.
    """
    chain = runs[0].chain
    total = sum(float(run.times[-1] - run.times[0]) for run in runs)
    kept = [
        _even(run.times, max(2, round(instants * float(run.times[-1] - run.times[0]) / total)))
        for run in runs
    ]
    times = _in_a_row([run.times[places] for run, places in zip(runs, kept, strict=True)])
    series = {TIME: Series("s", TIME, times, "since the start")}

    def values(slot: int) -> Array:
        pairs = zip(runs, kept, strict=True)
        return np.concatenate([run.q[slot, places] for run, places in pairs])

    for link in range(len(chain.links)):
        for node in range(chain.nodes):
            x, y, slope_x, slope_y = (values(slot) for slot in chain.slots(link, node))
            for direction, where in (("x", x), ("y", y)):
                name = f"{HEAD}{link + 1}/{node}_{direction}"
                series[name] = Series("m", TIME, where, "place of a node")
            if node == 0:
                heading = np.unwrap(np.arctan2(slope_y, slope_x))
                name = f"{HEAD}{link + 1}/heading"
                series[name] = Series("rad", TIME, heading, "direction at the joint")
    return series


def read_shapes(result: Result) -> ChainShapes | None:
    """The shapes that a result holds; None if it holds none."""
    if TIME not in result.arrays:
        return None
    places = (name.split("/") for name in result.arrays if name.startswith(HEAD))
    links = sorted({place[1] for place in places if len(place) == 3}, key=int)
    nodes = tuple(_nodes_of(result, link) for link in links)
    headings = tuple(result.arrays[f"{HEAD}{link}/heading"].values for link in links)
    return ChainShapes(result.arrays[TIME].values, nodes, headings)


def _nodes_of(result: Result, link: str) -> Array:
    """Places of the nodes of a link, (m, nodes, 2) [m]."""
    head = f"{HEAD}{link}/"
    count = sum(name.startswith(head) and name.endswith("_x") for name in result.arrays)
    places = [
        [result.arrays[f"{head}{node}_{axis}"].values for axis in "xy"] for node in range(count)
    ]
    return np.moveaxis(np.array(places), 2, 0)


def _in_a_row(times: Sequence[Array]) -> Array:
    """Times of all runs, where a run that has a clock of its own begins where the last one ended.

    The instant that two runs share stands twice, the second time right after the first: what a
    lock changes is then no motion.
    """
    joined = [times[0]]
    for run in times[1:]:
        end = float(joined[-1][-1])
        shift = end - run[0] if run[0] < end else 0.0
        joined.append(np.concatenate([[np.nextafter(run[0] + shift, np.inf)], run[1:] + shift]))
    return np.concatenate(joined)


def _even(times: Array, count: int) -> Array:
    """Indices of about `count` evenly spaced instants among those there are."""
    asked = np.linspace(times[0], times[-1], count)
    return np.unique(np.abs(times[:, None] - asked).argmin(axis=0))
