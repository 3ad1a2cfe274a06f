"""Stage 2: the folded antenna on the axis of the big arm, and torque and drive of the best turn."""

from math import pi

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle

from models.arm.parameters import ArmParameters
from models.truss import DYNAMIC_SET
from models.turn import (
    TurnParameters,
    least_torque_turn,
    stowed_ring_inertia,
    torsion_stiffness,
    turn_response,
)

TURN = TurnParameters(stowed_ring_inertia(DYNAMIC_SET, 30.0), torsion_stiffness(ArmParameters()))
DURATION, ACCELERATION = 2.5, 2.0  # [s, rad/s^2]


def sketch(panel: Axes) -> None:
    """Drive at the root, big arm as a torsion spring, folded small arm and stowed ring."""
    panel.add_patch(Rectangle((0.1, 1.6), 0.5, 0.8, facecolor="0.85", edgecolor="black"))
    panel.text(0.35, 1.35, "satellite", ha="center", va="top", fontsize=9)
    panel.add_patch(Rectangle((0.6, 1.75), 0.4, 0.5, facecolor="#9ecae1", edgecolor="black"))
    panel.text(0.8, 2.6, "drive, $\\beta$", ha="center", fontsize=9)
    panel.plot([1.0, 5.0], [2, 2], color="black", linewidth=3)
    panel.text(3.0, 2.15, "big arm, $k = GJ/L$", ha="center", fontsize=9)
    panel.plot([5.0, 2.3], [1.85, 1.85], color="#4a98c9", linewidth=2)
    panel.text(3.6, 1.6, "small arm, folded", ha="center", va="top", fontsize=9)
    panel.plot([0.2, 6.4], [2, 2], color="0.5", linewidth=0.8, linestyle="-.")
    # the ring is drawn beside the arm as seen along the axis
    panel.add_patch(Circle((7.4, 2.5), 0.5, fill=False, linewidth=2, color="#d55e00"))
    panel.plot(7.4, 2.0, "o", color="black", markersize=4)
    panel.annotate(
        "axis",
        (7.4, 2.0),
        xytext=(7.4, 1.2),
        ha="center",
        fontsize=9,
        arrowprops={"arrowstyle": "->"},
    )
    panel.plot([7.4, 7.4], [2.0, 2.5], color="#d55e00", linewidth=0.8)
    panel.text(7.45, 2.2, "$R(\\alpha_0)$", fontsize=8)
    panel.text(7.4, 3.15, "stowed ring, along the axis", ha="center", fontsize=9)
    panel.set_xlim(0, 8.8)
    panel.set_ylim(0.9, 3.5)
    panel.set_aspect("equal")
    panel.axis("off")


def turned(panel: Axes) -> None:
    """Torque of the best turn, and the drive's acceleration that gives it."""
    best = least_torque_turn(TURN, pi / 2, DURATION, ACCELERATION)
    assert best is not None
    edges, u = np.array(best.switches), np.array(best.accelerations)
    time = np.union1d(np.linspace(0.0, DURATION, 2001), edges)
    after = u[np.clip(np.searchsorted(edges, time, "right") - 1, 0, u.size - 1)]
    before = u[np.clip(np.searchsorted(edges, time) - 1, 0, u.size - 1)]
    moved = turn_response(TURN, time, before, after)
    panel.plot(time, moved.torque, color="#0072b2", label="torque in the big arm [N m]")
    label = "acceleration of the drive [rad/s²]"
    panel.step(time, after, where="post", color="#d55e00", linewidth=1, label=label)
    panel.set_xlabel("time [s]")
    panel.set_ylim(-6.5, 6.5)
    panel.legend(loc="upper right", fontsize=8)


figure, (left, right) = plt.subplots(
    1, 2, figsize=(11, 3.4), layout="constrained", width_ratios=(1.3, 1)
)
sketch(left)
turned(right)
figure.savefig("turn.png", dpi=130)
