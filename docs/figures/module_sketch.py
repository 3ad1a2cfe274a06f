"""Sketch of one module of the ring truss with its ropes and pulleys.

All points are nodes of `models.truss.module_nodes`, all lengths those of the kinematic set.
"""

from collections.abc import Sequence
from math import cos, degrees, pi, radians, sin

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle

from models.truss import KINEMATIC_SET, node_position

TRUSS = KINEMATIC_SET
BARS = ((1, 2), (5, 4))
CROSS_BARS = ((1, 6), (6, 5), (2, 3), (3, 4))
LINKS = ((7, 8), (13, 14), (9, 10), (11, 12))
SPRINGS = ((1, 8), (5, 14), (2, 10), (4, 12))
# where each rope runs within a module, and the nodes where a pulley turns it
UPPER_ROPE, LOWER_ROPE = (8, 1, 6, 5, 14), (10, 2, 3, 4, 12)
BAR, CROSS, LINK, SPRING, ROPE = "#0b5fa5", "#d1495b", "#5a8f29", "#8a8a8a", "#e08a00"


def place(node: int, angle: float) -> np.ndarray:
    """Horizontal and vertical position [m] of a node in the plane of its module."""
    x, _, z = node_position(TRUSS, node, angle).full().ravel()
    return np.array([x, z])


def line(panel: Axes, nodes: Sequence[int], angle: float, **look: object) -> None:
    """Straight pieces from node to node."""
    panel.plot(*np.array([place(node, angle) for node in nodes]).T, **look)


def rope(panel: Axes, nodes: Sequence[int], angle: float, up: float) -> None:
    """A rope over the bars' ends and under the middle; `up` is -1 for the lower rope."""
    radius = 0.024
    first, end, middle, other_end, last = (place(node, angle) for node in nodes)
    left = radius * np.array([-1.0, 0.0])
    inwards = radius * np.array([cos(angle), up * sin(angle)])
    outwards = radius * np.array([-cos(angle), up * sin(angle)])
    below = radius * np.array([0.0, -up])
    points = [
        *(first + left, end + left, end + inwards, middle + below),
        *(other_end + outwards, other_end - left, last - left),
    ]
    panel.plot(*np.array(points).T, color=ROPE, linewidth=1.5)


def spring(panel: Axes, first: int, last: int, angle: float, side: float) -> None:
    """A zigzag between two nodes, drawn beside the bar."""
    start, end = place(first, angle), place(last, angle)
    along = np.linspace(0, 1, 14)
    points = start + np.outer(along, end - start)
    points[:, 0] += side * 0.055
    points[2:-2, 0] += 0.016 * (-1.0) ** np.arange(10)
    panel.plot(*points.T, color=SPRING, linewidth=1.1)


def draw(panel: Axes, angle: float) -> None:
    """The module at an angle [rad]: bars, cross-bars, links, springs, ropes, pulleys, sliders."""
    for pair in BARS:
        line(panel, pair, angle, color=BAR, linewidth=3.2, solid_capstyle="round")
    for pair in CROSS_BARS:
        line(panel, pair, angle, color=CROSS, linewidth=2.4, solid_capstyle="round")
    for pair in LINKS:
        line(panel, pair, angle, color=LINK, linewidth=2.2, solid_capstyle="round")
    for (first, last), side in zip(SPRINGS, (-1, 1, -1, 1), strict=True):
        spring(panel, first, last, angle, side)

    for nodes, up in ((UPPER_ROPE, 1.0), (LOWER_ROPE, -1.0)):
        rope(panel, nodes, angle, up)
        for node in nodes:
            centre = place(node, angle)
            panel.add_patch(Circle(centre, 0.02, facecolor="white", edgecolor=ROPE, zorder=5))
    for node in (8, 14, 10, 12):
        x, z = place(node, angle)
        panel.plot(x, z, "s", color="black", markersize=4, zorder=6)
    panel.set_aspect("equal")
    panel.set_axis_off()


def note(panel: Axes, text: str, at: Sequence[float], to: Sequence[float], **look: object) -> None:
    """A label with a thin line to what it names."""
    arrow = {"arrowstyle": "-", "color": "0.35", "linewidth": 0.8}
    panel.annotate(text, xy=to, xytext=at, fontsize=9.5, arrowprops=arrow, **look)


def size(
    panel: Axes, text: str, first: np.ndarray, last: np.ndarray, away: np.ndarray, at: Sequence
) -> None:
    """A dimension: a double arrow beside two points, and its letter."""
    style = {"arrowstyle": "<->", "color": "0.25", "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0}
    panel.annotate("", xy=last + away, xytext=first + away, arrowprops=style)
    panel.text(*at, text, ha="center", va="center", fontsize=12, style="italic")


figure = plt.figure(figsize=(8.2, 5.3), layout="constrained")
panels = figure.subplot_mosaic(
    [["large", "folded"], ["large", "half"], ["large", "open"]], width_ratios=(2.5, 1)
)
large, angle = panels["large"], radians(58)
draw(large, angle)

at = {node: place(node, angle) for node in range(1, 15)}
across = np.array([cos(angle), sin(angle)])  # at right angles to the upper left cross-bar
size(large, "a", at[2], at[1], np.array([-0.17, 0]), (-0.205, -0.5))
size(large, "e", at[8], at[1], np.array([-0.10, 0]), (-0.135, -0.09))
size(large, "b", at[2], at[3], across * (0.06, -0.06), (0.33, -0.95))
size(large, "c", at[5], at[13], np.array([-0.045, 0.065]), (0.73, 0.06))
large.add_patch(Arc(at[1], 0.34, 0.34, theta1=270, theta2=270 + degrees(angle), color="0.25"))
large.text(0.07, -0.215, "α", fontsize=13)

note(large, "upper rope", (0.25, 0.06), at[1] + 0.4 * (at[6] - at[1]) + [0.0, 0.012])
note(large, "lower rope", (0.08, -0.60), at[2] + 0.4 * (at[3] - at[2]))
note(large, "half of a cross-bar, b", (0.44, -0.60), at[3] + 0.45 * (at[4] - at[3]))
note(large, "pulley", (0.34, -0.42), at[6])
note(large, "link, d", (0.60, -0.33), (at[13] + at[14]) / 2)
note(large, "slider", (0.60, -0.42), at[14])
note(large, "rope, on to the\nnext module", (0.91, -0.36), at[14] + [0.024, 0.01])
note(large, "crank, c", (0.92, 0.08), at[5] + 0.6 * (at[13] - at[5]))
note(large, "spring", (1.00, -0.02), (at[5] + at[14]) / 2 + [0.06, 0.02])
note(large, "vertical bar, a", (0.90, -0.55), (at[5] + at[4]) / 2)
large.set_xlim(-0.27, 1.18)
large.set_ylim(-1.08, 0.14)

for name, opened in (("folded", radians(12)), ("half", radians(58)), ("open", pi / 2)):
    draw(panels[name], opened)
    panels[name].set_title(f"α = {degrees(opened):.0f}°", fontsize=10)
    panels[name].set_xlim(-0.12, 2 * TRUSS.half_cross_bar + 0.12)
    panels[name].set_ylim(-1.08, 0.08)
figure.savefig("module_sketch.png", dpi=150)
