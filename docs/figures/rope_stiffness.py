"""A rope that gives between motor and truss, and the frequency of the truss on it."""

import dataclasses
from math import pi

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle

from models.truss import DYNAMIC_SET, least_rope_stiffness, rope_mode_frequency

FRICTIONS = (0.0, 0.01)
STIFFNESS = 600.0  # [N/m]


def sketch(panel: Axes) -> None:
    """The drum winds in h; the truss has taken s of it."""
    panel.add_patch(Circle((1, 2), 0.6, facecolor="0.9", edgecolor="black"))
    panel.text(1, 2, "drum", ha="center", va="center", fontsize=9)
    spring = np.linspace(2.2, 4.6, 13)
    teeth = 2.6 + 0.2 * np.array([0, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, 0])
    panel.plot([1, 2.2], [2.6, 2.6], color="#1f77b4", linewidth=2)
    panel.plot(spring, teeth, color="#1f77b4", linewidth=1.5)
    panel.plot([4.6, 6.4], [2.6, 2.6], color="#1f77b4", linewidth=2)
    panel.text(3.4, 3.0, "$k$", ha="center")
    panel.add_patch(Rectangle((6.4, 1.6), 1.8, 1.6, facecolor="0.9", edgecolor="black"))
    panel.text(7.3, 2.4, "truss\n$J(\\alpha)$, $U(\\alpha)$", ha="center", va="center", fontsize=9)
    for x, name in ((1.9, "$h$, wound in"), (6.0, "$s(\\alpha)$, taken")):
        panel.annotate("", (x - 0.7, 1.35), xytext=(x, 1.35), arrowprops={"arrowstyle": "->"})
        panel.text(x - 0.35, 1.0, name, ha="center", fontsize=9)
    panel.set_xlim(0, 8.6)
    panel.set_ylim(0.7, 3.6)
    panel.set_aspect("equal")
    panel.axis("off")


def frequencies(panel: Axes) -> None:
    """Of the truss at rest over the angle, for both frictions and the least stiffness of each."""
    for mu, colour in zip(FRICTIONS, ("#1f77b4", "#ff7f0e"), strict=True):
        truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=mu)
        net = truss.net_angle
        angles = np.linspace(truss.stowed_angle, pi / 2, 801)
        angles = np.union1d(angles, [np.nextafter(net, 0.0), net])
        least = least_rope_stiffness(truss).stiffness
        for stiffness, style in ((STIFFNESS, "-"), (least, "--")):
            frequency = rope_mode_frequency(truss, angles, stiffness)
            name = f"{stiffness:.3g} N/m, $\\mu$ = {mu:g}"
            panel.plot(np.degrees(angles), frequency, style, color=colour, label=name)
    panel.set_yscale("log")
    panel.set_ylim(0.02, 60)
    panel.set_xlabel("deployment angle α [deg]")
    panel.set_ylabel("frequency at rest [Hz]")
    panel.legend(fontsize=8)


figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
sketch(left)
frequencies(right)
figure.savefig("rope_stiffness.png", dpi=130)
