"""The ring on the tip of the bent arm, and the tip's motion under the paper's laws."""

import math

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from models.arm.parameters import ArmParameters
from models.laws import BetweenRests
from models.ring_on_arm import RingOnArm, arm_motion
from models.truss import DYNAMIC_SET
from studies.truss.motions.laws import paper_laws

MODEL = RingOnArm(ArmParameters(), DYNAMIC_SET)
DURATION, AFTER = 6.505, 6.0  # [s]
BENT = (0.5, 0.3, 0.35, 0.2)  # of the sketch, far more than of any motion [m, -, m, -]
RADIUS = 1.1  # of the sketch [m]


def sketch(panel: Axes) -> None:
    """Both links, the hoop, and what the equations name."""
    nodes = np.array(MODEL.carrier.node_coordinates(BENT, 12)).reshape(-1, 4)
    panel.plot(nodes[:, 0], nodes[:, 1], color="#1f77b4", linewidth=3)
    panel.plot([0, 5.4], [0, 0], color="0.6", linewidth=0.8, linestyle="--")
    panel.plot([0, 0], [-0.3, 0.3], color="black", linewidth=4)
    elbow, tip = nodes[13, :2], nodes[-1, :2]
    panel.plot(*elbow, "s", color="black")
    panel.plot(*tip, "o", color="black")

    angle = float(MODEL.turn(BENT)) + MODEL.reaction_angle
    centre = tip + RADIUS * np.array([math.cos(angle), math.sin(angle)])
    panel.add_patch(Circle(centre, RADIUS, fill=False, edgecolor="#d62728", linewidth=2))
    panel.annotate("", centre, xytext=tip, arrowprops={"arrowstyle": "-|>"})
    middle = (tip + centre) / 2
    panel.text(middle[0] + 0.1, middle[1], "$u$, $R(\\alpha)$")
    panel.text(centre[0] + 0.1, centre[1] + 0.1, "$M$, $M R^2$")
    panel.text(tip[0] + 0.12, tip[1] - 0.25, "$r$, $\\theta$")
    panel.text(elbow[0] - 0.1, elbow[1] + 0.2, "elbow, locked", ha="right")
    panel.text(0.1, -0.45, "root, clamped")
    panel.text(elbow[0], elbow[1] / 2, " $\\delta_1$")
    panel.set_aspect("equal")
    panel.axis("off")


def tips(panel: Axes) -> None:
    """The tip across the arm while the ring opens, and after it has stopped."""
    time = np.linspace(0.0, DURATION + AFTER, 1201)
    for deployment in paper_laws(DYNAMIC_SET, DURATION):
        moved = arm_motion(MODEL, BetweenRests(deployment.law, after=AFTER))
        panel.plot(time, 1e3 * moved.tip(time)[1], label=deployment.name)
    panel.axvline(DURATION, color="0.5", linewidth=0.8)
    panel.text(DURATION + 0.1, 38, "the ring is open", fontsize=9)
    panel.set_xlabel("time [s]")
    panel.set_ylabel("tip across the arm [mm]")
    panel.legend(loc="lower right")


figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
sketch(left)
tips(right)
figure.savefig("ring_on_arm.png", dpi=130)
