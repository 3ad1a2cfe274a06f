"""The ring on a test bench seen along its axis, and what resists the opening there."""

import dataclasses

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from models.truss import (
    DYNAMIC_SET,
    coulomb_torque,
    gravity_slope,
    potential_slope,
    ring_positions,
    static_torque,
)

HUNG = dataclasses.replace(
    DYNAMIC_SET, gravity=(-9.81, 0.0, 0.0), joint_coulomb=0.02, slider_coulomb=0.5
)


def sketch(panel: Axes) -> None:
    """Vertical bars at two angles, the chords on which they move, and the weight at the centre."""
    # both rings from the fixed bar, their centres to the right
    places = []
    for angle, shade in ((0.5, "0.6"), (0.9, "black")):
        corners = ring_positions(DYNAMIC_SET, angle)[:, 0, :2]
        towards = corners.mean(axis=0) / np.linalg.norm(corners.mean(axis=0))
        turned = np.stack([corners @ towards, corners @ [-towards[1], towards[0]]], axis=1)
        places.append(turned)
        panel.plot(*np.vstack([turned, turned[:1]]).T, "o-", color=shade, markersize=3)

    # every third chord
    before, after = places
    for k in range(3, 22, 3):
        panel.annotate("", after[k], xytext=before[k], arrowprops={"arrowstyle": "->"})

    # what holds the ring, and what pulls at it
    centre = after.mean(axis=0)
    panel.plot(0, 0, "s", color="#c25b1e", markersize=8)
    panel.text(-0.15, 0, "fixed\nbar", ha="right", va="center", color="#c25b1e")
    panel.annotate(
        "", centre - [1.2, 0], xytext=centre, arrowprops={"arrowstyle": "-|>", "color": "#1f77b4"}
    )
    panel.plot(*centre, "+", color="black")
    panel.text(centre[0] - 0.6, 0.12, "$(1-s)\\,M g$", ha="center", color="#1f77b4")
    panel.text(centre[0] + 0.1, -0.1, "centre", va="top")

    panel.text(
        centre[0],
        after[:, 1].min() - 0.5,
        "off-load friction along each chord",
        ha="center",
        fontsize=9,
    )
    panel.set_xlim(-1.3, after[:, 0].max() + 0.2)
    panel.set_aspect("equal")
    panel.axis("off")


def torques(panel: Axes) -> None:
    """What resists over the angle."""
    alpha = np.linspace(HUNG.stowed_angle, np.pi / 2, 601)
    angles = ca.DM(alpha)
    for name, torque, style in (
        ("weight, $-M g R'$", gravity_slope(HUNG, angles), "-"),
        ("springs and net, $U'$", potential_slope(DYNAMIC_SET, angles), "--"),
        ("Coulomb, $C$", coulomb_torque(HUNG, angles), ":"),
        ("all", static_torque(HUNG, angles), "-."),
    ):
        panel.plot(np.degrees(alpha), torque.full().ravel(), style, label=name)
    panel.set_xlabel("deployment angle α [deg]")
    panel.set_ylabel("torque against the opening [N m]")
    panel.set_ylim(bottom=0)
    panel.legend()


figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.8), layout="constrained")
sketch(left)
torques(right)
figure.savefig("test_bench.png", dpi=130)
