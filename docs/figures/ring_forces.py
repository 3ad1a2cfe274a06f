"""Forces on half a cross-bar and its link, and the force in each link of the ring at rest."""

import dataclasses
from math import cos, degrees, pi, radians, sin

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import CenteredNorm

from models.truss import DYNAMIC_SET, node_position, ring_forces

TRUSS = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01)
ANGLE = radians(55)
CROSS, LINK, FORCE = "#d1495b", "#5a8f29", "black"


def arrow(panel: Axes, at: np.ndarray, by: tuple[float, float], text: str) -> None:
    """A force on the part, named at its tail."""
    tail = at - np.array(by)
    look = {"arrowstyle": "-|>", "color": FORCE, "linewidth": 1.4}
    panel.annotate("", at, xytext=tail, arrowprops=look)
    panel.text(*(tail - 0.22 * np.array(by)), text, ha="center", va="center", fontsize=11)


def cut_free(panel: Axes) -> None:
    """Left half of an upper cross-bar with its link: nodes 1, 7, 6 and 8 of the module."""
    end, crank, middle, slider = (
        node_position(TRUSS, node, ANGLE).full().ravel()[[0, 2]] for node in (1, 7, 6, 8)
    )
    panel.plot(*np.array([end, slider - [0, 0.06]]).T, color="0.75", linewidth=5)
    panel.plot(*np.array([end, middle]).T, color=CROSS, linewidth=4)
    panel.plot(*np.array([slider, crank]).T, color=LINK, linewidth=3)
    for joint in (end, crank, middle):
        panel.plot(*joint, "o", color="white", markeredgecolor="black", markersize=7, zorder=5)
    panel.plot(*slider, "s", color="black", markersize=7)

    along = np.array([sin(ANGLE), -cos(ANGLE)])
    arrow(panel, middle, (-0.11, 0), "$N$")
    arrow(panel, middle, (0, -0.11), "$V$")
    arrow(panel, middle, tuple(-0.11 * along), "$T$")
    arrow(panel, slider, (0, 0.09), "$t/2$")
    arrow(panel, slider - np.array([0.03, 0]), (0, -0.09), "$S/2$")
    panel.text(*((end + crank) / 2 + [0.01, 0.025]), "$c$")
    panel.text(*((crank + middle) / 2 + [0.01, 0.025]), "$b - c$")
    panel.text(*((slider + crank) / 2 + [0.015, -0.03]), "$d$")
    panel.text(*(end + np.array([-0.01, 0.02])), "bar end", ha="left")
    panel.text(*(slider + np.array([0.02, -0.01])), "slider", ha="left", va="top")
    panel.set_aspect("equal")
    panel.margins(0.2)
    panel.axis("off")


def signs(panel: Axes) -> None:
    """Force in each link at rest, over angle and module."""
    angles = np.linspace(TRUSS.stowed_angle, pi / 2, 400)
    still = np.zeros_like(angles)
    links = ring_forces(TRUSS, angles, still, still).bars["link"]
    # left and right half of each module, in order round the ring
    rows = links.reshape(angles.size, -1).T
    image = panel.imshow(
        rows,
        aspect="auto",
        origin="lower",
        cmap="RdBu_r",
        norm=CenteredNorm(),
        extent=(degrees(angles[0]), 90, 0.5, TRUSS.modules + 0.5),
        interpolation="nearest",
    )
    panel.set_xlabel("deployment angle α [deg]")
    panel.set_ylabel("module from the motor; left and right half")
    plt.colorbar(image, ax=panel, label="force in the link [N], push positive")


figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
cut_free(left)
signs(right)
figure.savefig("ring_forces.png", dpi=130)
