"""The turn over time beside the paper's laws, and what each of them leaves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from studies.common.drawing import label_axes, legend_below, look, show_lowest
from studies.common.result import Result

PANELS = (
    ("antenna_angle", "angle of the antenna [deg]"),
    ("torque", "torque in the big arm [N m]"),
    ("drive_acceleration", "acceleration of the drive [rad/s²]"),
)


def draw(result: Result) -> Iterator[tuple[str, Figure]]:
    """Every figure of a result with the name of its file."""
    yield "turn", turn_figure(result)


def turn_figure(result: Result) -> Figure:
    """Angle, torque and acceleration of the drive over time, and the swing that is left."""
    figure = Figure(figsize=(10.0, 6.6), dpi=150, layout="constrained")
    figure.suptitle("The antenna turned about the axis of the big arm", fontsize=12)
    panels = figure.subplots(2, 2).ravel()
    for law in result.laws:
        colour, style = look(law)
        head = "" if law == result.laws[0] else f"{law}-"
        time = result.arrays[f"{head}time"].values
        for panel, (name, _) in zip(panels, PANELS, strict=False):
            values = result.arrays[f"{head}{name}"].values
            values = np.degrees(values) if name == "antenna_angle" else values
            shape = "steps-post" if name == "drive_acceleration" and not head else "default"
            panel.plot(time, values, style, color=colour, label=law, drawstyle=shape)
        swing = result.arrays[f"{law}-swing"].values
        panels[3].plot(result.arrays["after"].values, swing, style, color=colour)

    for panel, (_, label) in zip(panels, PANELS, strict=False):
        label_axes(panel, "time [s]", label)
    show_lowest(panels[2])
    label_axes(panels[3], "time since the drive stands [s]", "angle about rest [rad]")
    legend_below(figure, panels[0])
    return figure
