"""Figures of a robust law: its force in all scenarios and on the random trusses."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.common.drawing import COLOURS, label_axes
from studies.common.result import Result
from studies.robust.config import study_from
from studies.robust.study import NOMINAL_LAW, ROBUST
from studies.truss.figures import draw as draw_truss

LAWS = {ROBUST: COLOURS[0], NOMINAL_LAW: COLOURS[1]}


def draw(result: Result) -> Iterator[tuple[str, Figure]]:
    """The figure of the robust law, then those of any motion of the truss."""
    yield "robust", robust_figure(result)
    yield from draw_truss(result)


def robust_figure(result: Result) -> Figure:
    """Bands of the force over time, and peaks by scenario."""
    figure = Figure(figsize=(12.0, 4.6), dpi=150, layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.4, 1))
    _draw_bands(left, result)
    _draw_scenarios(right, result)
    return figure


def _draw_bands(panel: Axes, result: Result) -> None:
    for name, colour in LAWS.items():
        if f"{name}/time" not in result.arrays:
            continue
        time, low, high = (result.arrays[f"{name}/{c}"].values for c in ("time", "low", "high"))
        label = f"{name}: 5-95 %"
        if name == ROBUST:
            panel.fill_between(time, low, high, color=colour, alpha=0.3, lw=0, label=label)
            continue
        # two areas, one above the other, would have a third colour
        for edge, words in ((low, label), (high, None)):
            panel.plot(time, edge, "-.", color=colour, lw=1, label=words)
    time, force = (result.arrays[c].values for c in ("time", "motor_force"))
    panel.plot(time, force, color=LAWS[ROBUST], lw=1.2, label="robust, nominal truss")
    panel.axhline(
        result.details["motor_force"], color="0.3", ls="--", lw=1, label="required motor force"
    )
    floor = study_from(result.configuration).deployment.caps.least_tension
    panel.axhline(floor, color="0.3", ls=":", lw=1, label="minimum tension required")
    label_axes(panel, "time [s]", "force of the motor on one rope [N]")
    panel.set_title("rope force of the random trusses", fontsize=10)
    _legend_below(panel)


def _draw_scenarios(panel: Axes, result: Result) -> None:
    scenarios = result.details["scenarios"]
    places = np.arange(len(scenarios))
    for shift, (law, colour) in zip((-0.2, 0.2), LAWS.items(), strict=True):
        peaks = [one[law]["peak"] for one in scenarios.values()]
        bars = panel.barh(places + shift, peaks, 0.36, color=colour, label=law)
        panel.bar_label(bars, fmt="%.4g", padding=3, fontsize=8)
    own = list(result.details["scenario_bounds"].values())
    panel.plot(own, places, "|", color="0.1", ms=26, label="lower bound of this scenario")
    label_axes(panel, "peak rope force [N]", "")
    panel.set_yticks(places, list(scenarios))
    panel.margins(x=0.15, y=0.02)
    panel.set_ylim(len(scenarios) - 0.4, -0.6)
    panel.set_title("peak rope force by scenario", fontsize=10)
    _legend_below(panel)


def _legend_below(panel: Axes) -> None:
    """Outside, where it hides no bar and no band."""
    below = (0.5, -0.13)
    panel.legend(
        frameon=False,
        fontsize=8,
        loc="upper center",
        bbox_to_anchor=below,
        ncols=3,
        markerscale=0.4,
    )
