"""Motor, gear, drum and rope, and what the rotor adds to the motor's force under the Bezier law."""

import dataclasses
from math import degrees

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle

from models.truss import DYNAMIC_SET, static_peak
from studies.drive.schema import Drive
from studies.truss.motions.laws import paper_laws

TRUSS = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01)
DRIVE = Drive(drum_radius=0.02, gear_ratio=50.0, motor_inertia=2e-6)
DURATION = 10.0  # [s]


def sketch(panel: Axes) -> None:
    """The shaft from the motor to the drum, and the rope that it winds in."""
    panel.plot([1.2, 4.4], [2, 2], color="black", linewidth=2, zorder=0)
    boxes = (((0.2, 1.5), 1.0, "motor\nrotor $I$"), ((2.2, 1.4), 1.0, "gear\n$g$, $\\eta$"))
    for corner, width, text in boxes:
        height = 2 * (2 - corner[1])
        panel.add_patch(Rectangle(corner, width, height, facecolor="0.9", edgecolor="black"))
        panel.text(corner[0] + width / 2, 2, text, ha="center", va="center")
    panel.add_patch(Circle((5, 2), 0.6, facecolor="0.9", edgecolor="black"))
    panel.annotate("", (5.42, 2.42), xytext=(5, 2), arrowprops={"arrowstyle": "->"})
    panel.text(5.02, 2.3, "$r$", ha="right")
    panel.plot([5, 8], [1.4, 1.4], color="#1f77b4", linewidth=2)
    panel.annotate("", (8.6, 1.4), xytext=(7.6, 1.4), arrowprops={"arrowstyle": "-|>"})
    panel.text(8.1, 1.55, "$T_1$", ha="center")
    panel.annotate("", (6.2, 1.0), xytext=(7.4, 1.0), arrowprops={"arrowstyle": "->"})
    panel.text(6.8, 0.65, "$s$, $\\dot s$, $\\ddot s$", ha="center")
    panel.text(1.7, 2.15, "$\\tau$, $g \\dot s / r$", ha="center", fontsize=9)
    panel.text(5, 2.75, "drum", ha="center")
    panel.set_xlim(0, 9)
    panel.set_ylim(0.4, 3.1)
    panel.set_aspect("equal")
    panel.axis("off")


def forces(panel: Axes) -> None:
    """Force of rope and motor over the angle."""
    law, _ = paper_laws(TRUSS, DURATION, DRIVE)
    motion, truss = law.at(np.linspace(0.0, DURATION, 2001))
    angles = np.degrees(motion.angle)
    panel.plot(angles, truss.rope_force, label="rope, $T_1$")
    panel.plot(angles, law.motor(truss).force, "--", label="motor, $F$")
    ridge = static_peak(TRUSS)
    panel.plot(degrees(ridge.angle), ridge.force, "o", color="black", label="to restart there")
    panel.set_xlabel("deployment angle α [deg]")
    panel.set_ylabel("force on each rope [N]")
    panel.set_ylim(bottom=0)
    panel.legend(loc="lower center")


figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.4), layout="constrained")
sketch(left)
forces(right)
figure.savefig("rotor.png", dpi=130)
