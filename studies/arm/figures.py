"""Figures after 10, 15 and 16 of the paper, and 6 for the arm, each with all motions.

A function takes replays and returns a `Figure`; nothing is shown and no global state used.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.arm.replay import Replay
from studies.arm.stage import JOINT_NAMES

COLOURS = ("#0b5fa5", "#d1495b", "#5a8f29", "#8e6c8a", "#e09f3e", "#3d405b", "#7f7f7f")
STYLES = ("-", "--", "-.", ":", "-", "--", "-.")


def all_figures(replays: Sequence[Replay]) -> Iterator[tuple[str, Figure]]:
    """Every figure with the name of its file; the first replay is the optimum."""
    yield "fig06_snapshots", snapshots(replays[0])
    yield "fig10_torque", torque_figure(replays)
    name = "fig16_tip" if 1 in replays[0].motion.stage.moving else "fig15_tip"
    yield name, tip_figure(replays)
    yield "residual", residual_figure(replays)


def torque_figure(replays: Sequence[Replay]) -> Figure:
    """Fig. 10: driving torque of each joint that turns."""
    moving = replays[0].motion.stage.moving
    figure, axes = _row(len(moving), "Driving torque")
    for panel, k in zip(axes, moving, strict=True):
        for replayed, colour, style in _styled(replays):
            run = replayed.run.before
            panel.plot(run.times, run.torque[k], style, color=colour, label=replayed.motion.name)
        _label(panel, "time [s]", f"{JOINT_NAMES[k]} torque [N m]")
    _legend(figure, axes[0])
    return figure


def tip_figure(replays: Sequence[Replay]) -> Figure:
    """Figs 15 and 16: path of the tip, its speed, and the drift of the big arm's end."""
    figure, axes = _row(3, "Deployment of the arm, lock at the dotted line")
    for replayed, colour, style in _styled(replays):
        before, after = replayed.run.before, replayed.run.after
        parts = [before] + ([after] if after is not None else [])
        t = np.concatenate([p.times for p in parts])
        tip = np.concatenate([p.position(1) for p in parts], axis=1)
        elbow = np.concatenate([p.position(0) for p in parts], axis=1)
        chain = before.chain
        speed = np.concatenate([p.v[list(chain.slots(1, -1)[:2])] for p in parts], axis=1)
        name = replayed.motion.name
        axes[0].plot(t, tip[1], style, color=colour, label=name)
        axes[1].plot(t, np.hypot(*speed), style, color=colour)
        reach = chain.links[0].length
        if 0 in replayed.motion.stage.moving:
            end = replayed.motion.stage.duration
            late = t >= end
            rest = tip[:, late].mean(axis=1)
            off = 1e3 * np.hypot(*(tip[:, late] - rest[:, None]))
            axes[2].semilogy(t[late], np.maximum(off, 1e-6), style, color=colour)
        else:
            start = elbow[:, :1] / np.hypot(*elbow[:, 0]) * reach
            across = np.array([-start[1, 0], start[0, 0]]) / reach
            axes[2].plot(t, 1e3 * (across @ (elbow - start)), style, color=colour)
    third = (
        "tip from its mean after the lock [mm]"
        if 0 in replays[0].motion.stage.moving
        else "drift of the elbow, across [mm]"
    )
    for panel, label in zip(axes, ("tip, y [m]", "speed of the tip [m/s]", third), strict=True):
        panel.axvline(replays[0].motion.stage.duration, color="0.5", lw=0.8, ls=":")
        _label(panel, "time [s]", label)
    _legend(figure, axes[0])
    return figure


def residual_figure(replays: Sequence[Replay]) -> Figure:
    """Residual energy of all motions against their peak torque."""
    figure, axes = _row(1, "What is left after the lock")
    k = replays[0].motion.stage.moving[0]
    for number, (replayed, colour, _) in enumerate(_styled(replays)):
        axes[0].semilogy(
            replayed.peak_torque[k], replayed.residual_energy, "D" if number == 0 else "o",
            color=colour, label=replayed.motion.name, ls="none",
        )  # fmt: skip
    _label(axes[0], f"peak {JOINT_NAMES[k]} torque [N m]", "residual energy [J]", plain=False)
    axes[0].legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    axes[0].margins(0.15)
    return figure


def tradeoff_figure(curves: Mapping[str, tuple[Sequence[float], Sequence[float]]]) -> Figure:
    """Residual energy against duration, a curve a law."""
    figure, axes = _row(1, "Residual against duration")
    for (name, (t, left)), colour in zip(curves.items(), COLOURS, strict=False):
        axes[0].semilogy(t, left, "o-", ms=3, color=colour, label=name)
    _label(axes[0], "duration [s]", "residual energy [J]", plain=False)
    axes[0].legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def snapshots(replayed: Replay, count: int = 9) -> Figure:
    """The arm at even instants, as Fig. 6 shows its pendulum."""
    run = replayed.run.before
    figure = Figure(figsize=(5.2, 4.6), dpi=150, layout="constrained")
    panel = figure.subplots()
    for at in np.linspace(0.0, run.times[-1], count):
        i = int(np.argmin(np.abs(run.times - at)))
        shade = str(0.8 - 0.8 * at / run.times[-1])
        for link, width in ((0, 2.2), (1, 1.4)):
            points = np.array([run.position(link, n)[:, i] for n in range(run.chain.nodes)])
            panel.plot(*points.T, color=shade, lw=width)
        panel.plot(*run.position(1)[:, i], "o", color=shade, ms=5)
    panel.plot(0, 0, "s", color="#d1495b", ms=7)
    panel.set_aspect("equal")
    panel.set_title(f"{replayed.motion.name}: start light, lock dark", fontsize=10)
    _label(panel, "x [m]", "y [m]")
    panel.margins(0.05)
    return figure


def _row(panels: int, title: str) -> tuple[Figure, list[Axes]]:
    width = 4.3 * panels if panels > 1 else 6.4
    figure = Figure(figsize=(width, 3.8), dpi=150, layout="constrained")
    figure.suptitle(title, fontsize=12)
    return figure, list(figure.subplots(1, panels, squeeze=False)[0])


def _styled(replays: Sequence[Replay]) -> Iterator[tuple[Replay, str, str]]:
    yield from zip(replays, COLOURS, STYLES, strict=False)


def _label(panel: Axes, x: str, y: str, plain: bool = True) -> None:
    panel.set_xlabel(x)
    panel.set_ylabel(y)
    panel.grid(color="0.9", lw=0.6)
    panel.set_axisbelow(True)
    if plain:
        panel.margins(x=0.01)
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)


def _legend(figure: Figure, panel: Axes) -> None:
    handles, labels = panel.get_legend_handles_labels()
    columns = min(len(labels), 4)
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, frameon=False)
