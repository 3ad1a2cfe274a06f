"""Fig. 14: snapshots of the whole antenna opening, every rod of every module."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from numpy.typing import NDArray

from models.truss import TrussParameters, node_position
from studies.truss.deployment import Deployment

Array = NDArray[np.float64]

MOMENTS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)  # of the duration
VERTICAL = ((1, 2), (4, 5))
CROSS_BARS = ((2, 3), (3, 4), (5, 6), (6, 1))
LINKS = ((7, 8), (9, 10), (11, 12), (13, 14))
KINDS = (  # rods, colour, width, name
    (VERTICAL, "#0b5fa5", 1.3, "vertical bars"),
    (CROSS_BARS, "#d1495b", 0.8, "cross-bars"),
    (LINKS, "#5a8f29", 0.8, "links"),
)


def snapshots_figure(deployment: Deployment) -> Figure:
    """The truss at even times, all to the same scale."""
    figure = Figure(figsize=(12.0, 6.0), dpi=150, layout="constrained")
    figure.suptitle(f"The antenna opening under the {deployment.name} law, to scale", fontsize=12)
    for place, fraction in enumerate(MOMENTS, start=1):
        panel: Any = figure.add_subplot(2, 3, place, projection="3d")
        draw_snapshot(panel, deployment, fraction * deployment.law.duration)
    handles = panel.collections
    figure.legend(handles=handles, loc="outside lower center", ncols=len(KINDS), frameon=False)
    return figure


def draw_snapshot(panel: Any, deployment: Deployment, time: float) -> None:
    """The truss at a time [s] in a three-dimensional panel, with a title that says when."""
    truss = deployment.truss
    angle = float(deployment.law.motion(time).angle[0])
    _draw(panel, truss, angle)
    diameter = 2 * truss.half_cross_bar * math.sin(angle) / math.sin(math.pi / truss.modules)
    panel.set_title(
        f"t = {time:.4g} s,  α = {math.degrees(angle):.1f}°,  diameter {diameter:.2f} m",
        fontsize=10,
    )


def _draw(panel: Any, truss: TrussParameters, angle: float) -> None:
    radius = truss.half_cross_bar / math.sin(math.pi / truss.modules)
    for rods, colour, width, name in KINDS:
        lines = Line3DCollection(
            _segments(truss, angle, rods),
            colors=colour,
            linewidths=width,
            label=name,
            clip_on=False,
        )
        panel.add_collection3d(lines)
    # the fixed bar is at the origin; the ring opens along +y from it
    centre = ring_centre(truss, angle)
    panel.set_xlim(centre[0] - radius, centre[0] + radius)
    panel.set_ylim(centre[1] - radius, centre[1] + radius)
    panel.set_zlim(-truss.bar_length, 0)
    panel.set_box_aspect((2 * radius, 2 * radius, truss.bar_length), zoom=1.5)
    panel.view_init(elev=28, azim=-60)
    panel.set_axis_off()


def _segments(
    truss: TrussParameters, angle: float, rods: tuple[tuple[int, int], ...]
) -> list[Array]:
    return [
        np.stack([position(truss, angle, module, node) for node in rod])
        for module in range(1, truss.modules + 1)
        for rod in rods
    ]


def position(truss: TrussParameters, angle: float, module: int, node: int) -> Array:
    """Position of a node of a module, shape (3,) [m]."""
    place: Array = node_position(truss, node, ca.DM(angle), module=module).full().ravel()
    return place


def ring_centre(truss: TrussParameters, angle: float) -> Array:
    """Mean of the upper ends of all vertical bars, shape (3,) [m]."""
    modules = range(1, truss.modules + 1)
    centre: Array = np.mean([position(truss, angle, module, 1) for module in modules], axis=0)
    return centre
