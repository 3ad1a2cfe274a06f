"""Figures after 6, 10, 15 and 16 of the paper, each with all motions, and of what is left.

A function takes replays and returns a `Figure`; nothing is shown and no global state used. The
first replay is the optimum and drawn on top.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from numpy.typing import NDArray

from models.ancf.state import posed
from models.arm.reduced_simulation import ReducedMotion
from studies.arm.questions.trade_off import Curves
from studies.arm.replay.full import Replay
from studies.arm.stage import ELBOW, JOINT_NAMES, Stage
from studies.common.drawing import COLOURS, label_axes, legend_below, look, smoothest_on_top

Array = NDArray[np.float64]
Caps = tuple[float | None, float | None]
TITLES = {"big": "Big arm", "small": "Small arm", "both": "Both arms at once"}
_ENDS = {1: "tip", 0: "big arm's end"}  # by link


def all_figures(
    replays: Sequence[Replay], reduced: ReducedMotion | None = None, caps: Caps = (None, None)
) -> Iterator[tuple[str, Figure]]:
    """Every figure with the name of its file.

    `reduced` is the first motion on B21, `caps` are those on the joints' torques [N m].
    """
    moving = replays[0].motion.stage.moving
    if reduced is not None:
        yield "fig06_models", models_figure(replays[0], reduced)
    yield "fig10_torque", torque_figure(replays, caps)
    yield ("fig16_arm" if ELBOW in moving else "fig15_arm"), motion_figure(replays)
    yield "after_lock", after_figure(replays)
    yield "snapshots", snapshots(replays[0])


def models_figure(replayed: Replay, reduced: ReducedMotion) -> Figure:
    """Fig. 6: the same motion on two models, and how far apart they are."""
    figure, axes = _row(2, replayed, "the same torque on two models")
    run = replayed.run.before
    for axis, (name, link, paths) in enumerate(
        (("tip", 1, reduced.tip), ("big arm's end", 0, reduced.elbow))
    ):
        colour = COLOURS[axis]
        full = run.position(link)
        axes[0].plot(run.times, full[1], color=colour, label=f"{name}, full ANCF")
        axes[0].plot(reduced.times, paths[1], ":", color="k", lw=2.2,
                     label=None if axis == 0 else "reduced model B21")  # fmt: skip
        other = np.array([np.interp(run.times, reduced.times, row) for row in paths])
        off = 1e3 * np.hypot(*(full - other))
        axes[1].plot(run.times, off, color=colour, label=name)
    label_axes(axes[0], "time [s]", "y [m]")
    axes[1].set_ylim(bottom=0.0)
    label_axes(axes[1], "time [s]", "models apart by [mm]")
    axes[1].legend(frameon=False)
    legend_below(figure, axes[0], 4)
    return figure


def torque_figure(replays: Sequence[Replay], caps: Caps = (None, None)) -> Figure:
    """Fig. 10: torque of each joint that turns, given or the reaction to its angle."""
    moving = replays[0].motion.stage.moving
    figure, axes = _row(
        len(moving), replays[0], "joint torque" + (", caps dotted" if any(caps) else "")
    )
    for panel, k in zip(axes, moving, strict=True):
        for replayed, lines in _styled(replays):
            run = replayed.run.before
            panel.plot(run.times, run.torque[k], **lines)
        smoothest_on_top(panel)
        cap = caps[k]
        for side in () if cap is None else (-cap, cap):
            panel.axhline(side, color="0.5", lw=0.8, ls=":")
        label_axes(panel, "time [s]", f"{JOINT_NAMES[k]} torque [N m]")
    if len(replays) > 1:
        legend_below(figure, axes[0], 4)
    return figure


def motion_figure(replays: Sequence[Replay]) -> Figure:
    """Figs 15 and 16: displacement and speed of the arm's end, and what else the paper shows."""
    moving = replays[0].motion.stage.moving
    panels = _small_panels() if ELBOW in moving else _big_panels()
    if len(moving) > 1:
        panels = panels[:3]  # the elbow does not drift but turn
    figure, axes = _row(len(panels), replays[0], "motion of the end, locked at the dotted line")
    for replayed, lines in _styled(replays):
        t, path, speed = _history(replayed)
        for panel, (_, column) in zip(axes, panels, strict=True):
            panel.plot(t, column(path, speed), **lines)
    for panel, (label, _) in zip(axes, panels, strict=True):
        smoothest_on_top(panel)
        panel.axvline(replays[0].motion.stage.duration, color="0.5", lw=0.8, ls=":")
        label_axes(panel, "time [s]", label)
    if len(replays) > 1:
        legend_below(figure, axes[0], 4)
    return figure


def _big_panels() -> list[tuple[str, Any]]:
    return [
        ("big arm's end, y [m]", lambda path, speed: path[0][1]),
        ("big arm's end, speed along x [m/s]", lambda path, speed: speed[0][0]),
    ]


def _small_panels() -> list[tuple[str, Any]]:
    return [
        ("tip, y [m]", lambda path, speed: path[1][1]),
        ("tip, speed along x [m/s]", lambda path, speed: speed[1][0]),
        ("tip, x [m]", lambda path, speed: path[1][0]),
        ("big arm's end, drift along x [mm]",
         lambda path, speed: 1e3 * (path[0][0] - path[0][0][0])),
    ]  # fmt: skip


def _history(replayed: Replay) -> tuple[Array, list[Array], list[Array]]:
    """Times, and paths and speeds (2, m) of both links' ends, the lock passed."""
    before, after = replayed.run.before, replayed.run.after
    parts = [before] + ([after] if after is not None else [])
    chain = before.chain
    t = np.concatenate([p.times for p in parts])
    path = [np.concatenate([p.position(k) for p in parts], axis=1) for k in (0, 1)]
    ends = [list(chain.slots(k, -1)[:2]) for k in (0, 1)]
    return t, path, [np.concatenate([p.v[end] for p in parts], axis=1) for end in ends]


def after_figure(replays: Sequence[Replay]) -> Figure:
    """How the tip swings about its rest after the lock, and how far both ends come off at most.

    Of one motion, how both ends swing.
    """
    figure, axes = _row(2, replays[0], "vibration after the lock")
    end = replays[0].motion.stage.end
    followed = [(r, lines) for r, lines in _styled(replays) if r.run.after is not None]
    swings = [(lines, *_swing(r)) for r, lines in followed]
    for panel, link in zip(axes, _ENDS if len(swings) == 1 else (1,), strict=False):
        heading = sum(end[: link + 1])
        across = np.array([-np.sin(heading), np.cos(heading)])
        for lines, t, off in swings:
            panel.plot(t, across @ off[link], **lines)
        what = f"{_ENDS[link]} off its rest, across [mm]"
        label_axes(panel, "time since the lock [s]", what)
    if len(swings) > 1:
        names = [r.motion.name for r, _ in followed]
        _bars(axes[1], names, [[np.hypot(*off[x]).max() for x in _ENDS] for *_, off in swings])
        legend_below(figure, axes[0], 4)
    return figure


def _swing(replayed: Replay) -> tuple[Array, dict[int, Array]]:
    """Times since the lock [s] and how far each link's end is off its rest, (2, m) [mm]."""
    after = replayed.run.after
    assert after is not None
    rest = posed(after.chain, [float(x) for x in after.joint_angles()[:, 0]]).q
    slots = {link: list(after.chain.slots(link, -1)[:2]) for link in _ENDS}
    off = {link: 1e3 * (after.q[place] - rest[place, None]) for link, place in slots.items()}
    return after.times - after.times[0], off


def _bars(panel: Axes, names: Sequence[str], largest: Sequence[Sequence[float]]) -> None:
    """Largest distances of both ends from rest of each motion, [mm], logarithmic."""
    place, rows = np.arange(len(names)), np.array(largest)
    for k, (name, colour) in enumerate(zip(_ENDS.values(), ("0.25", "0.65"), strict=True)):
        panel.barh(place + 0.4 * k - 0.2, rows[:, k], 0.38, color=colour, label=name)
    decades = np.log10([rows.min(), rows.max()])
    panel.set_xscale("log")
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.set_xlim(10 ** np.floor(decades[0] - 0.05), 10 ** np.ceil(decades[1] + 0.05))
    panel.set_yticks(place, names)
    panel.invert_yaxis()
    label_axes(panel, "largest distance from rest [mm]", "", fit=False)
    panel.legend(frameon=False, fontsize=8, ncols=2, loc="lower right", bbox_to_anchor=(1, 1))


def residual_figure(pairs: Sequence[tuple[Replay | None, Sequence[Replay]]]) -> Figure:
    """Residual energy against peak torque; each optimum below the baselines it stands beside."""
    first = pairs[0][1][0]
    figure, axes = _row(1, first, "residual energy after the lock")
    k = first.motion.stage.moving[0]

    def place(replayed: Replay) -> tuple[float, float]:
        return float(replayed.peak_torque[k]), replayed.residual_energy

    optima = [optimum for optimum, _ in pairs if optimum is not None]
    for number, best in enumerate(optima):
        axes[0].semilogy(*place(best), "D", color=COLOURS[0], zorder=3,
                         label=None if number else "optimum")  # fmt: skip
    for optimum, baselines in pairs:
        for b in baselines:
            colour, _ = look(b.motion.name)
            axes[0].semilogy(*place(b), "o", color=colour, label=b.motion.name)
            if optimum is not None:
                ends = zip(place(b), place(optimum), strict=True)
                axes[0].semilogy(*ends, ":", color=colour, lw=1)
    label_axes(axes[0], f"peak {JOINT_NAMES[k]} torque [N m]", "residual energy [J]", fit=False)
    axes[0].legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5),
                   title="dotted: a law and\nits optimum", title_fontsize=8)  # fmt: skip
    axes[0].margins(0.1)
    return figure


def tradeoff_figure(stage: Stage, curves: Curves, between: Curves) -> Figure:
    """Residual energy against duration: marks on the full model, lines `between` them on B21."""
    figure = Figure(figsize=(7.2, 4.2), dpi=150, layout="constrained")
    panel = figure.subplots()
    for name, (t, left) in curves.items():
        best = name == next(iter(curves))
        colour, _ = look(name)
        if name in between:
            panel.semilogy(*between[name], color=colour, lw=1.0)
        panel.semilogy(t, left, "D--" if best else "o", ms=5, color=colour, label=name)
    panel.set_title(
        f"{TITLES[stage.name]}, torque drive: residual energy against duration", fontsize=12
    )
    label_axes(panel, "duration [s]", "residual energy [J]", fit=False)
    title = "marks: full model" + ("\nlines: B21" if between else "")
    panel.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5),
                 title=title, title_fontsize=8)  # fmt: skip
    return figure


def snapshots(replayed: Replay, count: int = 9) -> Figure:
    """The arm at even instants."""
    run = replayed.run.before
    figure = Figure(figsize=(5.2, 4.6), dpi=150, layout="constrained")
    panel = figure.subplots()
    for at in np.linspace(0.0, run.times[-1], count):
        i = int(np.argmin(np.abs(run.times - at)))
        shade = str(0.8 - 0.8 * at / run.times[-1])
        for link, width, colour in ((0, 3.0, shade), (1, 1.4, COLOURS[1])):
            points = np.array([run.position(link, n)[:, i] for n in range(run.chain.nodes)])
            panel.plot(*points.T, color=colour, lw=width, solid_capstyle="round",
                       alpha=1.0 if link == 0 else 0.3 + 0.7 * at / run.times[-1])  # fmt: skip
        panel.plot(*run.position(1)[:, i], "o", color=shade, ms=6, zorder=3)
    panel.plot(0, 0, "s", color=COLOURS[0], ms=8, zorder=4)
    panel.set_aspect("equal")
    stage = replayed.motion.stage
    panel.set_title(f"{TITLES[stage.name]}, {stage.duration:.4g} s: nine even instants, light to "
                    "dark\nbig arm grey, small arm red, antenna dot, root square",
                    fontsize=9)  # fmt: skip
    label_axes(panel, "x [m]", "y [m]", fit=False)
    panel.margins(0.05)
    return figure


def _row(panels: int, replayed: Replay, what: str) -> tuple[Figure, list[Axes]]:
    rows, columns = (2, 2) if panels == 4 else (1, panels)
    width = 4.3 * columns if panels > 1 else 6.4
    figure = Figure(figsize=(width, 3.2 * rows + 0.6), dpi=150, layout="constrained")
    stage = replayed.motion.stage
    head = f"{TITLES[stage.name]} in {stage.duration:.4g} s, {replayed.motion.drive} drive"
    figure.suptitle(f"{head}: {what}", fontsize=12)
    return figure, list(figure.subplots(rows, columns, squeeze=False).flat)


def _styled(replays: Sequence[Replay]) -> Iterator[tuple[Replay, dict[str, Any]]]:
    for number, replayed in enumerate(replays):
        colour, style = look(replayed.motion.name)
        first = number == 0
        yield replayed, {
            "color": colour, "ls": style, "lw": 2.2 if first else 1.2,
            "zorder": 3 if first else 2, "label": replayed.motion.name,
        }  # fmt: skip
