"""Ropes that give: the mode of the truss on them, and the swing of a law."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np
from matplotlib.figure import Figure

from models.truss import kinetic_energy, least_rope_stiffness, rope_mode_frequency, whole_opening
from studies.common.drawing import label_axes
from studies.truss.motions.deployment import Deployment

ANGLES = 801
FARTHEST, NEAREST = 30.0, 1e-3  # [deg] before the end, between which kinetic energies are drawn
ON_TIME: Mapping[str, Any] = {"color": "0.5", "label": "both on time"}
STIFFER = (0.25, 1.0, 4.0, 16.0)  # of the stated stiffness; what snaps through is left out


def rope_mode_figure(deployment: Deployment) -> Figure:
    """Frequency over the angle for several stiffnesses; angle and force of the law on its ropes."""
    truss, drive = deployment.truss, deployment.drive
    assert drive is not None
    assert drive.rope_stiffness is not None
    figure = Figure(figsize=(12.9, 3.8), dpi=150, layout="constrained")
    figure.suptitle(
        f"The {deployment.name} law on flexible ropes, {drive.rope_stiffness:g} N/m each",
        fontsize=12,
    )
    mode, angle, force = figure.subplots(1, 3)

    net = truss.net_angle  # at which the frequency steps: the net adds its stiffness
    ends = deployment.opening or whole_opening(truss)
    alpha = np.linspace(ends.start, ends.end, ANGLES)
    if ends.start < net < ends.end:
        alpha = np.union1d(alpha, [np.nextafter(net, 0.0), net])
    least = least_rope_stiffness(truss, drive.rope_yields, ends).stiffness
    for share in STIFFER:
        stiffness = share * drive.rope_stiffness
        if stiffness <= least:
            continue
        frequency = rope_mode_frequency(truss, alpha, stiffness, drive.rope_yields)
        width = 1.8 if share == 1.0 else 0.9
        mode.plot(np.degrees(alpha), frequency, lw=width, label=f"{stiffness:.4g} N/m")
    mode.set_yscale("log")
    label_axes(mode, "angle α [deg]", "frequency at rest, motor held [Hz]")
    mode.legend(frameon=False, fontsize=8, title=f"minimum: {least:.4g} N/m", title_fontsize=8)

    swing = deployment.rope_swing
    angle.plot(swing.time, np.degrees(swing.angle - swing.meant_angle), color="C1")
    label_axes(angle, "time [s]", "angle less that of the law [deg]")
    force.plot(swing.time, swing.meant_tension, color="0.5", label="rigid ropes")
    force.plot(swing.time, swing.tension[0], color="C1", lw=1.0, label="flexible ropes")
    label_axes(force, "time [s]", "force on each rope [N]")
    force.legend(frameon=False, fontsize=8)
    return figure


def rope_delay_figure(deployment: Deployment) -> Figure:
    """Kinetic energy over the angle, and both ropes' forces, with one motor behind the other."""
    drive, swing = deployment.drive, deployment.swing_with_one_behind
    assert drive is not None
    assert swing is not None
    figure = Figure(figsize=(8.6, 3.8), dpi=150, layout="constrained")
    figure.suptitle(
        f"The {deployment.name} law with one motor {drive.rope_delay:g} s later than the other, "
        f"ropes of {drive.rope_stiffness:g} N/m",
        fontsize=12,
    )
    energy, force = figure.subplots(1, 2)

    # a logarithmic axis shows the last of the opening, up to where the truss arrives
    end, arrival = float(np.degrees(deployment.law.end_angle)), swing.arrival_energy
    meant = deployment.law.motion(np.minimum(swing.time, deployment.law.duration))
    both = ((meant.angle, meant.speed), (swing.angle, swing.speed))
    for (angle, speed), look in zip(both, (ON_TIME, {"color": "C1", "lw": 1.0}), strict=True):
        left = end - np.degrees(angle)
        shown = slice(int(np.argmax(left < FARTHEST)), int(np.argmax(np.append(left, 0) < NEAREST)))
        moving = kinetic_energy(deployment.truss, ca.DM(angle), ca.DM(speed)).full().ravel()
        energy.plot(left[shown], moving[shown], **{"label": "one late", **look})
    energy.set_xscale("log")
    energy.xaxis.set_major_formatter("{x:g}")
    energy.set_yscale("log")
    energy.set_xlim(FARTHEST, NEAREST)
    reached = "is not reached" if math.isnan(arrival) else f"is reached with {arrival:.2g} J"
    energy.set_title(f"{end:.4g} deg {reached}", fontsize=10)
    label_axes(
        energy, f"angle short of {end:.4g} deg [deg]", "kinetic energy of the truss [J]", fit=False
    )
    energy.legend(frameon=False, fontsize=8)

    force.plot(swing.time, swing.meant_tension, **ON_TIME)
    for tension, colour, name in zip(swing.tension, ("C1", "C0"), ("ahead", "behind"), strict=True):
        force.plot(swing.time, tension, color=colour, lw=1.0, label=f"the rope {name}")
    label_axes(force, "time [s]", "force on each rope [N]")
    force.legend(frameon=False, fontsize=8)
    return figure
