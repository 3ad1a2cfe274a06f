"""Figures that set motions side by side: baselines, durations, a spread of arms, a sequence.

Every figure is drawn from a result, whether it was just made or loaded.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from matplotlib.figure import Figure

from studies.arm.report.figures import TITLES, Scene, motion_figures
from studies.arm.report.traces import Trace, traced_laws
from studies.arm.stage import JOINT_NAMES
from studies.common.drawing import COLOURS, STYLES, label_axes, legend_below, look
from studies.common.result import Result
from studies.fronts import figures as front_figures

_SIZE = 12  # of a title
_MARKS = ("o", "s", "D")  # of motions on the full model


def draw(result: Result) -> Iterator[tuple[str, Figure]]:
    """All figures of a result of the arm, with the names of their files."""
    if result.kind == "arm":
        yield from motion_figures(result)
    elif result.kind == "arm-baselines":
        yield from motion_figures(result)
        yield "residual", residual_figure(result)
    elif result.kind == "arm-sequence":
        yield "fig10_torques", sequence_figure(result)
        if traced_laws(result):
            yield "fig15_16_arm", sequence_motion_figure(result)
    elif result.kind == "pareto-arm":
        yield from front_figures.draw(result)
    elif result.kind == "robust":
        yield "spread", spread_figure(result)
        yield "torque", robust_torque_figure(result)
        if "draws" in result.arrays:
            yield "draws", draws_figure(result)


def residual_figure(result: Result) -> Figure:
    """Residual energy against peak torque; each optimum below the baseline it stands beside."""
    scene = Scene.of(result)
    rows = {row.key: row.values for row in result.table}
    torque = f"peak_{JOINT_NAMES[scene.moving[0]]}_torque"

    def place(law: str, head: str = "") -> tuple[float, float]:
        return rows[f"{head}{torque}"][law], rows[f"{head}residual_energy"][law]

    figure = Figure(figsize=(6.4, 3.8), dpi=150, layout="constrained")
    figure.suptitle(f"{scene.title}: residual energy after the lock", fontsize=_SIZE)
    panel = figure.subplots()

    # one entry of the legend stands for all optima
    with_optimum = [law for law in result.laws if np.isfinite(place(law, "optimum_")).all()]
    for number, law in enumerate(with_optimum):
        label = None if number else "optimum"
        panel.semilogy(*place(law, "optimum_"), "D", color=COLOURS[0], zorder=3, label=label)

    for law in result.laws:
        colour, _ = look(law)
        panel.semilogy(*place(law), "o", color=colour, label=law)
        if law in with_optimum:
            ends = zip(place(law), place(law, "optimum_"), strict=True)
            panel.semilogy(*ends, ":", color=colour, lw=1)

    joint = JOINT_NAMES[scene.moving[0]]
    label_axes(panel, f"peak {joint} torque [N m]", "residual energy [J]", fit=False)
    panel.legend(
        frameon=False,
        fontsize=8,
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
        title="dotted: a law and\nits optimum",
        title_fontsize=8,
    )
    panel.margins(0.1)
    return figure


def sequence_figure(result: Result) -> Figure:
    """Both torques over time, with the rigid bound and the locks."""
    figure = Figure(figsize=(7.2, 4.0), dpi=150, layout="constrained")
    panel = figure.subplots()
    times = result.arrays["figure/time"].values
    big, dwell, small = result.details["durations"]

    # nothing is drawn while a joint is locked: there is no torque to choose
    turning = {"root": times <= big, "elbow": times >= big + dwell}
    for (joint, while_driven), colour in zip(turning.items(), COLOURS, strict=False):
        torque = result.arrays[f"figure/{joint}_torque"].values
        panel.plot(times[while_driven], torque[while_driven], color=colour, label=f"{joint} torque")

    bound = result.details["rigid_bound_Nm"]
    for sign in (-1, 1):
        label = "rigid bound" if sign > 0 else None
        panel.axhline(sign * bound, color="0.6", lw=0.8, ls="--", label=label)
    for lock in (big, big + dwell + small):
        panel.axvline(lock, color="0.5", lw=0.8, ls=":")
    panel.set_title("Big arm, locked dwell, small arm: joint torques, locks dotted", fontsize=_SIZE)
    label_axes(panel, "time [s]", "torque [N m]")
    legend_below(figure, panel)
    return figure


def sequence_motion_figure(result: Result) -> Figure:
    """Places of elbow and tip through both motions, the dwell and a quarter of a motion beyond."""
    big, dwell, small = result.details["durations"]
    # each motion has a time of its own
    starts = dict(zip(traced_laws(result), (0.0, big + dwell), strict=True))
    figure = Figure(figsize=(8.6, 3.8), dpi=150, layout="constrained")
    panels = figure.subplots(1, 2)
    for panel, axis in zip(panels, (0, 1), strict=True):
        for point, colour in zip(("tip", "elbow"), COLOURS, strict=False):
            for name, start in starts.items():
                trace = Trace.read(result, name)
                label = {"tip": "tip", "elbow": "big arm's end"}[point] if start == 0.0 else None
                panel.plot(trace.times + start, trace.path[point][axis], color=colour, label=label)
        for lock in (big, big + dwell + small):
            panel.axvline(lock, color="0.5", lw=0.8, ls=":")
        label_axes(panel, "time [s]", f"{'xy'[axis]} [m]")
    legend_below(figure, panels[0])
    figure.suptitle("Big arm, locked dwell, small arm: motion, locks dotted", fontsize=_SIZE)
    return figure


def spread_figure(result: Result) -> Figure:
    """Worst residual along each factor, whatever the other one is, of all motions."""
    details = result.details
    points: Mapping[str, int] = details["points"]
    figure = Figure(figsize=(11, 4.6), dpi=150, layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axis, (panel, factor) in enumerate(zip(panels, details["axes"], strict=True)):
        looks = zip(_motions(result), COLOURS, STYLES, _MARKS, strict=False)
        for name, colour, line, mark in looks:
            for model, shown in (("B21", {"ls": line}), ("full model", {"ls": "", "marker": mark})):
                count = points[model]
                values = result.arrays[f"{name}: residual, {model}"].values.reshape(count, count)
                side = 100 * np.linspace(-details["width"], details["width"], count)
                # the worst over the other factor; marks are open, where they lie on each other
                worst = values.max(axis=1 - axis)
                panel.semilogy(side, worst, color=colour, mfc="none", mew=1.5, ms=8, **shown)
            both = {"ls": line, "marker": mark, "mfc": "none", "mew": 1.5, "ms": 8}
            panel.semilogy([], [], color=colour, label=name, **both)
        label_axes(panel, f"{factor} off its nominal value [%]", "", fit=False)
    panels[0].set_ylabel("worst $\\sqrt{E_{res}}$ [$\\sqrt{J}$]")

    reduced, full = (f"{count} x {count}" for count in (points["B21"], points["full model"]))
    figure.legend(
        *panels[0].get_legend_handles_labels(),
        loc="outside lower center",
        ncols=3,
        frameon=False,
        title=f"lines: {reduced} arms on B21; marks: {full} arms on the full model",
    )
    what = "worst residual after the lock, whatever the other factor is"
    figure.suptitle(f"{_robust_title(result)}: {what}")
    return figure


def robust_torque_figure(result: Result) -> Figure:
    """Torque of all motions on the nominal arm."""
    figure = Figure(figsize=(8, 4.2), dpi=150, layout="constrained")
    panel = figure.subplots()
    times = result.arrays["figure/time"].values
    for name, colour, style in zip(_motions(result), COLOURS, STYLES, strict=False):
        panel.plot(times, result.arrays[f"{name}: torque"].values, style, color=colour, label=name)
    joint = result.details["stage"]["joint"]
    label_axes(panel, "time [s]", f"{joint} torque [N m]")
    panel.legend(frameon=False)
    figure.suptitle(f"{_robust_title(result)}: torque on the nominal arm")
    return figure


def draws_figure(result: Result) -> Figure:
    """Shares of the drawn arms against the energy that they are left with."""
    figure = Figure(figsize=(8, 4.2), dpi=150, layout="constrained")
    panel = figure.subplots()
    shares = 100 * result.arrays["draws"].values
    for name, colour, style in zip(_motions(result), COLOURS, STYLES, strict=False):
        if (series := result.arrays.get(f"{name}: draws")) is not None:
            panel.semilogx(series.values, shares, style, color=colour, label=name)
    allowed = result.configuration["allowed_energy"]
    panel.axvline(allowed, color="0.3", ls=":", lw=1, label="allowed")
    label_axes(panel, "residual energy [J]", "arms with no more [%]", fit=False)
    panel.legend(frameon=False)
    figure.suptitle(f"{_robust_title(result)}: {shares.size} arms drawn from the spread, on B21")
    return figure


def _motions(result: Result) -> list[str]:
    """Names of the motions, the nominal one first."""
    return [motion["name"] for motion in result.details["motions"]]


def _robust_title(result: Result) -> str:
    stage, drive = result.configuration["stage"], result.configuration["drive"]
    return f"{TITLES[stage]} in {result.details['stage']['duration']:.4g} s, {drive} drive"
