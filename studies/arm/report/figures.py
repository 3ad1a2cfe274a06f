"""Figures after 6, 10, 15 and 16 of the paper, each with all motions, and of what is left.

Every figure is drawn from a result, whether it was just made or loaded. Nothing is shown and no
global state used. The first motion is the optimum and drawn on top.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from ocp.arrays import Array
from studies.arm.report.profile import read_reduced
from studies.arm.report.traces import Snapshot, Trace, read_snapshots, traced_laws
from studies.arm.stage import ELBOW, JOINT_NAMES, ROOT
from studies.common.drawing import COLOURS, label_axes, legend_below, look, smoothest_on_top
from studies.common.result import Result

CapPair = tuple[float | None, float | None]
TITLES = {"big": "Big arm", "small": "Small arm", "both": "Both arms at once"}
_NAMES = {"tip": "tip", "elbow": "big arm's end"}  # of what is followed, in the order drawn
_SIZE = 12  # of a title


@dataclass(frozen=True)
class Scene:
    """What the titles and panels of a motion's figures need to know.

    Attributes
    ----------
    stage : its name.
    duration : [s].
    start, end : (root, elbow) joint angles [rad].
    drive : "torque" or "angle".
    """

    stage: str
    duration: float
    start: tuple[float, float]
    end: tuple[float, float]
    drive: str

    @classmethod
    def of(cls, result: Result) -> Scene:
        """The scene of a result."""
        stage = result.details["stage"]
        return cls(
            stage=result.configuration["stage"],
            duration=stage["duration"],
            start=tuple(stage["start"]),
            end=tuple(stage["end"]),
            drive=result.configuration.get("drive", "torque"),
        )

    @property
    def moving(self) -> tuple[int, ...]:
        """Joints that turn."""
        return tuple(k for k in (ROOT, ELBOW) if self.start[k] != self.end[k])

    @property
    def title(self) -> str:
        """What moves, how long and how."""
        return f"{TITLES[self.stage]} in {self.duration:.4g} s, {self.drive} drive"


def motion_figures(result: Result) -> Iterator[tuple[str, Figure]]:
    """Every figure of a result with traces of motions, with the name of its file."""
    scene = Scene.of(result)
    traces = [Trace.read(result, law) for law in traced_laws(result)]
    if not traces:
        return
    yield from figures_of(
        scene,
        traces,
        reduced=read_reduced(result),
        caps=_caps(result),
        snapshots=read_snapshots(result),
    )
    if "loads/root_moment" in result.arrays:
        yield "satellite", satellite_figure(result, scene)


def satellite_figure(result: Result, scene: Scene) -> Figure:
    """Moment and momentum that a satellite takes, beside its wheels' caps, or how far it turns."""
    caps = {row.key: row.cap for row in result.table}
    shown = [
        ("root_moment", "moment about the root [N m]", 1.0, caps["peak_root_moment"]),
        ("angular_momentum", "momentum of the arm [N m s]", 1.0, caps["peak_angular_momentum"]),
        ("satellite_angle", "turn of the satellite [deg]", float(np.degrees(1.0)), None),
    ]
    shown = [one for one in shown if f"loads/{one[0]}" in result.arrays]
    figure, axes = _row(len(shown), scene, "the satellite")
    time = result.arrays["loads/time"].values
    for panel, (name, words, unit, cap) in zip(axes, shown, strict=True):
        panel.plot(time, unit * result.arrays[f"loads/{name}"].values, color=COLOURS[0])
        panel.axvline(scene.duration, color="0.5", lw=0.8)
        for limit in () if cap is None else (-cap, cap):
            panel.axhline(limit, color="0.4", lw=0.8, ls=":")
        label_axes(panel, "time [s], grey: the lock", words)
    return figure


def figures_of(
    scene: Scene,
    traces: Sequence[Trace],
    *,
    reduced: tuple[Array, Mapping[str, Array]] | None = None,
    caps: CapPair = (None, None),
    snapshots: Sequence[Snapshot] = (),
) -> Iterator[tuple[str, Figure]]:
    """Every figure with the name of its file.

    Parameters
    ----------
    scene : Scene
    traces : motions, the optimum first.
    reduced : times and paths of the first motion on B21.
    caps : on the torques of root and elbow [N m].
    snapshots : of the first motion.
    """
    if reduced is not None:
        yield "fig06_models", models_figure(scene, traces[0], *reduced)
    yield "fig10_torque", torque_figure(scene, traces, caps)
    name = "fig16_arm" if ELBOW in scene.moving else "fig15_arm"
    yield name, motion_figure(scene, traces)
    if any(trace.since_lock.size for trace in traces):
        yield "after_lock", after_figure(scene, traces)
    if snapshots:
        yield "snapshots", snapshot_figure(scene, snapshots)


def _caps(result: Result) -> CapPair:
    """Caps on the torques of root and elbow, where the table has them."""
    caps = {row.key: row.cap for row in result.table}
    root, elbow = (caps.get(f"peak_{joint}_torque") for joint in JOINT_NAMES)
    return root, elbow


def models_figure(scene: Scene, trace: Trace, times: Array, paths: Mapping[str, Array]) -> Figure:
    """Fig. 6: the same motion on two models, and how far apart they are."""
    figure, (places, apart) = _row(2, scene, "the same torque on two models")
    until = slice(None, trace.lock)
    for point, colour in zip(_NAMES, COLOURS, strict=False):
        full, reduced = trace.path[point][:, until], paths[point]
        places.plot(trace.times[until], full[1], color=colour, label=f"{_NAMES[point]}, full ANCF")
        # one entry of the legend is enough for both dotted lines
        label = None if point == "tip" else "reduced model B21"
        places.plot(times, reduced[1], ":", color="k", lw=2.2, label=label)

        other = np.array([np.interp(trace.times[until], times, row) for row in reduced])
        off = 1e3 * np.hypot(*(full - other))
        apart.plot(trace.times[until], off, color=colour, label=_NAMES[point])

    label_axes(places, "time [s]", "y [m]")
    apart.set_ylim(bottom=0.0)
    label_axes(apart, "time [s]", "models apart by [mm]")
    apart.legend(frameon=False)
    legend_below(figure, places, 4)
    return figure


def torque_figure(scene: Scene, traces: Sequence[Trace], caps: CapPair = (None, None)) -> Figure:
    """Fig. 10: torque of each joint that turns, given or the reaction to its angle."""
    what = "joint torque" + (", caps dotted" if any(caps) else "")
    figure, axes = _row(len(scene.moving), scene, what)
    for panel, k in zip(axes, scene.moving, strict=True):
        for trace, style in _styled(traces):
            panel.plot(trace.times[: trace.lock], trace.torque[k, : trace.lock], **style)
        # a law that jumps would hide the others
        smoothest_on_top(panel)

        cap = caps[k]
        for side in () if cap is None else (-cap, cap):
            panel.axhline(side, color="0.5", lw=0.8, ls=":")
        label_axes(panel, "time [s]", f"{JOINT_NAMES[k]} torque [N m]")

    if len(traces) > 1:
        legend_below(figure, axes[0], 4)
    return figure


def motion_figure(scene: Scene, traces: Sequence[Trace]) -> Figure:
    """Figs 15 and 16: displacement and speed of the arm's end, and what else the paper shows."""
    panels = _small_panels() if ELBOW in scene.moving else _big_panels()
    if len(scene.moving) > 1:
        panels = panels[:3]  # the elbow does not drift but turn
    figure, axes = _row(len(panels), scene, "motion of the end, locked at the dotted line")
    for trace, style in _styled(traces):
        for panel, (_, column) in zip(axes, panels, strict=True):
            panel.plot(trace.times, column(trace), **style)

    for panel, (label, _) in zip(axes, panels, strict=True):
        smoothest_on_top(panel)
        panel.axvline(scene.duration, color="0.5", lw=0.8, ls=":")
        label_axes(panel, "time [s]", label)
    if len(traces) > 1:
        legend_below(figure, axes[0], 4)
    return figure


def _big_panels() -> list[tuple[str, Any]]:
    return [
        ("big arm's end, y [m]", lambda trace: trace.path["elbow"][1]),
        ("big arm's end, speed along x [m/s]", lambda trace: trace.velocity["elbow"][0]),
    ]


def _small_panels() -> list[tuple[str, Any]]:
    def drift(trace: Trace) -> Array:
        along_x = trace.path["elbow"][0]
        return np.asarray(1e3 * (along_x - along_x[0]))

    return [
        ("tip, y [m]", lambda trace: trace.path["tip"][1]),
        ("tip, speed along x [m/s]", lambda trace: trace.velocity["tip"][0]),
        ("tip, x [m]", lambda trace: trace.path["tip"][0]),
        ("big arm's end, drift along x [mm]", drift),
    ]


def after_figure(scene: Scene, traces: Sequence[Trace]) -> Figure:
    """How the tip swings about its rest after the lock, and how far both ends come off at most.

    Of one motion, how both ends swing.
    """
    figure, axes = _row(2, scene, "vibration after the lock")
    followed = [(trace, style) for trace, style in _styled(traces) if trace.since_lock.size]
    one = len(followed) == 1

    headings = {"elbow": scene.end[ROOT], "tip": sum(scene.end)}
    for panel, point in zip(axes, _NAMES if one else ("tip",), strict=False):
        heading = headings[point]
        across = np.array([-np.sin(heading), np.cos(heading)])
        for trace, style in followed:
            panel.plot(trace.since_lock, across @ (1e3 * trace.off_rest[point]), **style)
        what = f"{_NAMES[point]} off its rest, across [mm]"
        label_axes(panel, "time since the lock [s]", what)

    if not one:
        largest = [
            [1e3 * float(np.hypot(*trace.off_rest[point]).max()) for point in _NAMES]
            for trace, _ in followed
        ]
        _bars(axes[1], [trace.name for trace, _ in followed], largest)
        legend_below(figure, axes[0], 4)
    return figure


def _bars(panel: Axes, names: Sequence[str], largest: Sequence[Sequence[float]]) -> None:
    """Largest distances of both ends from rest of each motion, [mm], logarithmic."""
    place, rows = np.arange(len(names)), np.array(largest)
    for k, (name, colour) in enumerate(zip(_NAMES.values(), ("0.25", "0.65"), strict=True)):
        panel.barh(place + 0.4 * k - 0.2, rows[:, k], 0.38, color=colour, label=name)

    # whole decades: with less room the labels of the ticks run into each other
    decades = np.log10([rows.min(), rows.max()])
    panel.set_xscale("log")
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.set_xlim(10 ** np.floor(decades[0] - 0.05), 10 ** np.ceil(decades[1] + 0.05))
    panel.set_yticks(place, names)
    panel.invert_yaxis()
    label_axes(panel, "largest distance from rest [mm]", "", fit=False)
    panel.legend(frameon=False, fontsize=8, ncols=2, loc="lower right", bbox_to_anchor=(1, 1))


def snapshot_figure(scene: Scene, snapshots: Sequence[Snapshot]) -> Figure:
    """The arm at even instants, and how the link behind the joint that turns bends."""
    figure = Figure(figsize=(9.4, 4.6), dpi=150, layout="constrained")
    panel, bending = figure.subplots(1, 2)
    _bending(bending, scene, snapshots)
    for snapshot, share in zip(snapshots, _shares(snapshots), strict=True):
        shade = str(0.8 - 0.8 * share)
        panel.plot(*snapshot.big, color=shade, lw=3.0, solid_capstyle="round")
        faint = 0.3 + 0.7 * share
        panel.plot(*snapshot.small, color=COLOURS[1], lw=1.4, solid_capstyle="round", alpha=faint)
        panel.plot(*snapshot.small[:, -1], "o", color=shade, ms=6, zorder=3)
    panel.plot(0, 0, "s", color=COLOURS[0], ms=8, zorder=4)

    panel.set_aspect("equal")
    panel.set_title(
        f"{TITLES[scene.stage]}, {scene.duration:.4g} s: nine even instants, light to dark\n"
        "big arm grey, small arm orange, antenna dot, root square",
        fontsize=9,
    )
    label_axes(panel, "x [m]", "y [m]", fit=False)
    panel.margins(0.05)
    return figure


def _shares(snapshots: Sequence[Snapshot]) -> list[float]:
    """Parts of the time that have passed, exactly one at the last: a shade has no room beyond."""
    return [snapshot.time / snapshots[-1].time for snapshot in snapshots]


def _bending(panel: Axes, scene: Scene, snapshots: Sequence[Snapshot]) -> None:
    """How far a link is off the straight line between its ends, along it."""
    small = ELBOW in scene.moving
    for snapshot, share in zip(snapshots, _shares(snapshots), strict=True):
        nodes = snapshot.small if small else snapshot.big
        chord = nodes[:, -1] - nodes[:, 0]
        along = chord / np.hypot(*chord)
        across = np.array([-along[1], along[0]])
        places = nodes - nodes[:, :1]
        shade = str(0.8 - 0.8 * share)
        label = f"{snapshot.time:.3g} s"
        panel.plot(along @ places, 1e3 * (across @ places), ".-", ms=4, color=shade, label=label)
    panel.axhline(0.0, color=COLOURS[0], lw=0.8, ls=":")
    panel.set_title(
        f"bending of the {'small' if small else 'big'} arm at its model's nodes", fontsize=9
    )
    label_axes(panel, "along the straight line between its ends [m]", "off that line [mm]")
    # the curves reach into every corner of the panel
    panel.legend(
        frameon=False, fontsize=8, ncols=5, loc="upper center", bbox_to_anchor=(0.5, -0.14)
    )


def _row(panels: int, scene: Scene, what: str) -> tuple[Figure, list[Axes]]:
    """A figure of panels side by side, four of them in a square."""
    rows, columns = (2, 2) if panels == 4 else (1, panels)
    width = 4.3 * columns if panels > 1 else 6.4
    figure = Figure(figsize=(width, 3.2 * rows + 0.6), dpi=150, layout="constrained")
    figure.suptitle(f"{scene.title}: {what}", fontsize=_SIZE)
    return figure, list(figure.subplots(rows, columns, squeeze=False).flat)


def _styled(traces: Sequence[Trace]) -> Iterator[tuple[Trace, dict[str, Any]]]:
    """Each motion with how its line looks."""
    for number, trace in enumerate(traces):
        colour, style = look(trace.name)
        first = number == 0
        yield (
            trace,
            {
                "color": colour,
                "ls": style,
                "lw": 2.2 if first else 1.2,
                "zorder": 3 if first else 2,
                "label": trace.name,
            },
        )
