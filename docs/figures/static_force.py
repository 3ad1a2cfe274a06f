"""The rope force that holds the truss at rest, over its angle, without and with pulley friction."""

import dataclasses
from math import degrees, pi

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np

from models.truss import DYNAMIC_SET, static_force, static_peak

angles = np.linspace(DYNAMIC_SET.stowed_angle, pi / 2, 1001)
figure, panel = plt.subplots(figsize=(7, 3.4), layout="constrained")
for friction, style in ((0.0, "-"), (0.01, "--")):
    truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=friction)
    force = static_force(truss, ca.DM(angles)).full().ravel()
    (curve,) = panel.plot(np.degrees(angles), force, style, label=f"pulley friction {friction:g}")
    ridge = static_peak(truss)
    where = degrees(ridge.angle)
    panel.plot(where, ridge.force, "o", color=curve.get_color())
    panel.annotate(
        f"{ridge.force:.1f} N at {where:.1f}°",
        (where, ridge.force),
        xytext=(77, ridge.force + 2),
        ha="right",
        arrowprops={"arrowstyle": "-", "color": "0.6", "linewidth": 0.8},
    )
panel.axvline(degrees(DYNAMIC_SET.net_angle), color="0.6", linewidth=0.8)
panel.text(79.5, 1, "the net becomes taut", ha="right", color="0.4")
panel.set_xlabel("deployment angle α [deg]")
panel.set_ylabel("static force on each rope [N]")
panel.set_ylim(0, 45)
panel.legend(loc="upper left")
figure.savefig("static_force.png", dpi=130)
