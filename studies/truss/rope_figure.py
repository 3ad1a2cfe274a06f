"""Ropes that give: the mode of the truss on them, and the swing of a law."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from models.truss import least_rope_stiffness, rope_mode_frequency, whole_opening
from studies.common.drawing import label_axes
from studies.truss.motions.deployment import Deployment

ANGLES = 801
STIFFER = (0.25, 1.0, 4.0, 16.0)  # of the stated stiffness; what snaps through is left out


def rope_mode_figure(deployment: Deployment) -> Figure:
    """Frequency over the angle for several stiffnesses; angle and force of the law on its ropes."""
    truss, drive = deployment.truss, deployment.drive
    assert drive is not None
    assert drive.rope_stiffness is not None
    figure = Figure(figsize=(12.9, 3.8), dpi=150, layout="constrained")
    figure.suptitle(
        f"The {deployment.name} law on ropes that give, {drive.rope_stiffness:g} N/m each",
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
    mode.legend(frameon=False, fontsize=8, title=f"least: {least:.4g} N/m", title_fontsize=8)

    swing = deployment.rope_swing
    angle.plot(swing.time, np.degrees(swing.angle - swing.meant_angle), color="C1")
    label_axes(angle, "time [s]", "angle less that of the law [deg]")
    force.plot(swing.time, swing.meant_tension, color="0.5", label="rigid ropes")
    force.plot(swing.time, swing.tension, color="C1", lw=1.0, label="ropes that give")
    label_axes(force, "time [s]", "force on each rope [N]")
    force.legend(frameon=False, fontsize=8)
    return figure
