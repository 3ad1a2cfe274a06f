"""A satellite that turns with its arm and ring: what is called how, and its turn by the ring."""

import math
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle
from matplotlib.transforms import Affine2D

from models.arm.parameters import ArmParameters
from models.ring_on_arm import free_turn, held_momentum
from models.truss import DYNAMIC_SET
from studies.truss.motions.laws import paper_laws

INERTIA = 2000.0  # of the satellite about the root [kg m^2]
ACROSS = math.pi / 2  # from the arm to the ring's centre [rad]
TURN, JOINT, ELBOW = -0.22, 0.75, 0.5  # of the sketch [rad]
RADIUS = 0.8  # of the sketch [m]


def sketch(panel: Axes) -> None:
    """Satellite, both links and the hoop, with their angles."""
    turned = Affine2D().rotate(TURN) + panel.transData
    panel.add_patch(
        Rectangle((-2.0, -0.7), 2.0, 1.4, facecolor="0.88", edgecolor="black", transform=turned)
    )
    panel.text(-1.0, 0.25, "satellite, $H$", ha="center", va="center")
    panel.plot([0, 2.6], [0, 0], color="0.6", linewidth=0.8, linestyle="--")
    axis = 2.6 * np.array([math.cos(TURN), math.sin(TURN)])
    panel.plot([0, axis[0]], [0, axis[1]], color="black", linewidth=0.8)

    big, small = TURN + JOINT, TURN + JOINT + ELBOW
    elbow = 3.0 * np.array([math.cos(big), math.sin(big)])
    tip = elbow + 2.0 * np.array([math.cos(small), math.sin(small)])
    panel.plot(*zip((0, 0), elbow, tip, strict=True), color="#1f77b4", linewidth=3)
    panel.plot(*zip((0, 0), elbow, tip, strict=True), "o", color="black", markersize=5)
    centre = tip + RADIUS * np.array([-math.sin(small), math.cos(small)])
    panel.add_patch(Circle(tuple(centre), RADIUS, fill=False, edgecolor="#d62728", linewidth=2))
    panel.annotate("", centre, xytext=tip, arrowprops={"arrowstyle": "-|>"})
    panel.text(centre[0] + 0.12, centre[1] + 0.05, "$M$")

    for radius, begin, end, name in ((2.3, 0.0, TURN, "$\\theta_0$"), (1.5, TURN, big, "joint")):
        arc = np.linspace(begin, end, 40)
        panel.plot(radius * np.cos(arc), radius * np.sin(arc), color="black", linewidth=0.9)
        middle = (begin + end) / 2
        panel.text(
            1.06 * radius * math.cos(middle), 1.06 * radius * math.sin(middle), name, va="center"
        )
    panel.annotate("root", (0, 0), xytext=(0.15, -1.15), arrowprops={"arrowstyle": "-"})
    panel.text(elbow[0] + 0.15, elbow[1] - 0.25, "elbow")
    panel.set_aspect("equal")
    panel.margins(0.05)
    panel.axis("off")


def turns(panel: Axes) -> None:
    """The satellite's turn against the ring's angle, which no law changes."""
    angles = np.linspace(DYNAMIC_SET.stowed_angle, math.pi / 2, 101)
    arm = ArmParameters()
    for mass, words in ((arm.tip_mass, "antenna of 30 kg"), (8.764, "ring alone")):
        carried = replace(arm, tip_mass=mass)
        turned = [free_turn(carried, DYNAMIC_SET, ACROSS, INERTIA, float(a)) for a in angles]
        panel.plot(np.degrees(angles), np.degrees(turned), label=words)
    panel.set_xlabel("angle of the ring [deg]")
    panel.set_ylabel("turn of the satellite [deg]")
    panel.legend(loc="lower left")


def handed(panel: Axes) -> None:
    """The momentum that the paper's laws hand over in 10 s, where the satellite is held."""
    time = np.linspace(0.0, 10.0, 401)
    for paper in paper_laws(DYNAMIC_SET, 10.0):
        motion = paper.law.motion(time)
        state = (motion.angle, motion.speed)
        momentum = held_momentum(ArmParameters(), DYNAMIC_SET, ACROSS, *state)
        panel.plot(time, np.array(momentum).ravel(), label=paper.name)
    panel.set_xlabel("time [s]")
    panel.set_ylabel("momentum handed over [N m s]")
    panel.legend(loc="upper right")


figure, panels = plt.subplots(
    1, 3, figsize=(12, 3.6), layout="constrained", width_ratios=(1.25, 1, 1)
)
for draw, panel in zip((sketch, turns, handed), panels, strict=True):
    draw(panel)
figure.savefig("satellite.png", dpi=130)
