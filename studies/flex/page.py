"""What a report shows of a chain of links: curves of all series, and the links in motion."""

from __future__ import annotations

import numpy as np

from studies.common.charts import Chart
from studies.common.result import Result
from studies.common.scene import links
from studies.common.scene.chain_shapes import ChainShapes
from studies.common.scene.moving_picture import MovingPicture
from studies.flex.figures import links_of, poses_of


def charts(result: Result) -> tuple[Chart, ...]:
    """All series over time."""
    return links.charts(result, by_meaning=True)


def scene(result: Result) -> MovingPicture | None:
    """The links in motion; None of a result without poses."""
    if "pose" not in result.arrays:
        return None
    shapes = _poses(result)
    names = [f"link {number}" for number in range(len(shapes.nodes))]
    return links.moving_links(result, shapes, "the links in motion", names)


def _poses(result: Result) -> ChainShapes:
    """The poses of a case; the heading of a link is that of its first element."""
    times, x, y = poses_of(result)
    places = np.stack([x, y], axis=2)
    parts = np.split(places, links_of(result), axis=1)
    first = [nodes[:, 1] - nodes[:, 0] for nodes in parts]
    headings = tuple(np.unwrap(np.arctan2(step[:, 1], step[:, 0])) for step in first)
    return ChainShapes(times, tuple(parts), headings)
