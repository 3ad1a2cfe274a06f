"""The timeline of a mission: what turns when, what is used of each cap, what the arm does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.common.drawing import COLOURS, STYLES, label_axes, look
from studies.common.result import Result

ABOUT = {
    "big arm": "axis of the root",
    "turn": "axis of the big arm",
    "small arm": "axis of the elbow",
    "ring": "axis of the elbow",
}
SHADE = 0.12  # of the span in which a stage moves
LEAST_SHOWN = 1e-2  # [%] of a cap, from which its part is a bar
ROOM = 20.0  # times the longest bar, for the words beside it


def draw(result: Result) -> Iterator[tuple[str, Figure]]:
    """Every figure of a result with the name of its file."""
    yield "timeline", timeline_figure(result)
    yield "satellite", satellite_figure(result)
    yield "caps", caps_figure(result)


def satellite_figure(result: Result) -> Figure:
    """Moment and momentum at the root beside the wheels' caps, or how far the satellite turns."""
    turns = [name for name in result.arrays if name.startswith("satellite_about_")]
    figure = Figure(figsize=(12.0, 2.6 * (3 if turns else 2)), dpi=150, layout="constrained")
    panels = figure.subplots(3 if turns else 2, 1, sharex=True)
    time, stages = result.arrays["time"].values, result.details["stages"]

    # what a held satellite takes; both signs count for a wheel
    for panel, name, words, cap in zip(
        panels,
        ("root_moment", "root_momentum"),
        ("moment about the root [N m]", "momentum at the root [N m s]"),
        ("wheel_torque", "wheel_momentum"),
        strict=False,
    ):
        _spans(panel, stages)
        panel.plot(time, result.arrays[name].values, color="black", lw=1.2)
        limit = result.configuration.get(cap)
        for line in () if limit is None else (-limit, limit):
            panel.axhline(line, color="0.4", lw=0.8, ls=":")
        label_axes(panel, "time [s]", words)

    # turns about different axes are not added
    for name, colour, style in zip(turns, COLOURS, STYLES, strict=False):
        series = result.arrays[name]
        about = series.meaning.removeprefix("turn of the satellite ")
        panels[-1].plot(time, np.degrees(series.values), style, color=colour, label=about)
    if turns:
        _spans(panels[-1], stages)
        label_axes(panels[-1], "time [s]", "turn of the satellite [deg]")
        _legend_above(panels[-1])

    _names(panels[0], stages)
    return figure


def timeline_figure(result: Result) -> Figure:
    """Angles and parts of the caps along the mission; below, the arm while the ring opens."""
    figure = Figure(figsize=(12.0, 8.6), dpi=150, layout="constrained")
    shaken = "reaction" in result.arrays  # else it was stopped before the ring moved
    panels = figure.subplots(3 if shaken else 2, 1)
    panels[1].sharex(panels[0])
    stages = result.details["stages"]
    _draw_angles(panels[0], result, stages)
    _draw_drives(panels[1], result, stages)
    if shaken:
        _draw_vibration(panels[2], result)
    return figure


def caps_figure(result: Result) -> Figure:
    """The use of each cap, and the energy left after each stage; pale if it does not count."""
    stages = result.details["stages"]
    uses = [(stage["stage"], use) for stage in stages for use in stage["uses"]]
    figure = Figure(figsize=(10.0, 1.2 + 0.36 * len(uses)), dpi=150, layout="constrained")
    figure.suptitle(
        "Use of each cap (pale: not part of the utilisation, because the motion was planned with "
        "it)",
        fontsize=12,
    )
    panel = figure.subplots()

    colours = {stage["stage"]: colour for stage, colour in zip(stages, COLOURS, strict=False)}
    shares = [max(100 * use["share"], LEAST_SHOWN) for _, use in uses]
    bars = panel.barh(range(len(uses)), shares, color=[colours[n] for n, _ in uses], height=0.6)
    for bar, (_, use) in zip(bars, uses, strict=True):
        bar.set_alpha(1.0 if use["counts"] and not use["limit"] else 0.35)
    for place, (share, (_, use)) in enumerate(zip(shares, uses, strict=True)):
        panel.annotate(
            f"{use['value']:.3g} of {use['cap']:.3g} {use['unit']}",
            (share, place),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=9,
            bbox={"fc": "w", "ec": "none", "pad": 0.5},  # the line may be behind it
        )
    panel.axvline(100.0, color="0.4", lw=0.8, ls=":", zorder=0)
    panel.set_xscale("log")
    panel.set_xlim(LEAST_SHOWN, ROOM * max(100.0, *shares))
    label_axes(panel, "fraction of the cap [%], dotted: 100 %", "")
    panel.set_yticks(range(len(uses)), [f"{name}: {use['title']}" for name, use in uses])
    panel.invert_yaxis()
    return figure


def _spans(panel: Axes, stages: Sequence[Mapping[str, Any]]) -> None:
    for stage, colour in zip(stages, COLOURS, strict=False):
        panel.axvspan(stage["start"], stage["start"] + stage["duration"], color=colour, alpha=SHADE)


def _names(panel: Axes, stages: Sequence[Mapping[str, Any]]) -> None:
    """The stages above their spans, and the axis each of them turns about."""
    for stage, colour in zip(stages, COLOURS, strict=False):
        middle = stage["start"] + stage["duration"] / 2
        panel.annotate(
            f"{stage['stage']}\n{ABOUT[stage['stage']]}",
            (middle, 1.0),
            xytext=(0, 3),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=9,
            color=colour,
        )


def _legend_above(panel: Axes) -> None:
    """A legend where no curve is."""
    panel.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=5)


def _draw_angles(panel: Axes, result: Result, stages: Sequence[Mapping[str, Any]]) -> None:
    time = result.arrays["time"].values
    _spans(panel, stages)
    for stage, colour in zip(stages, COLOURS, strict=False):
        name = stage["stage"]
        angle = np.degrees(result.arrays[f"{name.replace(' ', '_')}_angle"].values)
        panel.plot(time, angle, color=colour, label=f"{name}: {stage['duration']:.4g} s")
    label_axes(panel, "time [s]", "angle of joint or ring [deg]")
    _legend_above(panel)


def _draw_drives(panel: Axes, result: Result, stages: Sequence[Mapping[str, Any]]) -> None:
    """Torques, rope force and reaction, each over its cap."""
    time = result.arrays["time"].values
    _spans(panel, stages)
    for stage, colour in zip(stages, COLOURS, strict=False):
        name, caps = stage["stage"], {use["title"]: use["cap"] for use in stage["uses"]}
        drive = result.arrays[f"{name.replace(' ', '_')}_drive"].values
        title = "peak rope force" if name == "ring" else "peak torque"
        inside = (time >= stage["start"]) & (time <= stage["start"] + stage["duration"])
        words = "rope force of the ring" if name == "ring" else f"torque of the {name}"
        panel.plot(time[inside], drive[inside] / caps[title], color=colour, label=words)
        if name == "ring":
            reaction = result.arrays["reaction"].values[inside] / caps["peak reaction on the arm"]
            panel.plot(time[inside], reaction, "--", color=COLOURS[3], label="reaction of the ring")
    for sign in (-1.0, 1.0):
        panel.axhline(sign, color="0.4", lw=0.8, ls=":")
    label_axes(panel, "time [s]", "fraction of the cap [-]")
    _legend_above(panel)


def _draw_vibration(panel: Axes, result: Result) -> None:
    axis = result.arrays["since the ring's start"].values
    looks = {
        "optimal": (*look("optimum"), "the optimum"),
        "optimum without arm": (COLOURS[3], ":", "the optimum without arm"),
        "Bezier": (*look("Bezier"), "Bezier"),
        "Step5": (*look("Step5"), "Step5"),
    }
    for name, (colour, style, law) in looks.items():
        if f"tip/{name}" not in result.arrays:
            continue  # it was stopped before
        tip = 1e3 * result.arrays[f"tip/{name}"].values
        panel.plot(axis, tip, style, color=colour, lw=1.2, label=f"ring by {law}")
    label_axes(panel, "time since the ring's start [s]", "tip across the arm [mm]")
    # it ends below the legend
    panel.axvline(result.details["stages"][-1]["duration"], ymax=0.74, color="0.5", lw=0.8)
    panel.set_title("the arm shaken by the ring (grey line: the ring has stopped)", fontsize=10)
    panel.legend(frameon=False, loc="upper right", ncols=2)
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + 0.35 * (high - low))  # room for the legend
