"""The figure of margins along the travel: what resists, and what the motor has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from studies.common.drawing import label_axes, legend_below, look, show_lowest
from studies.margin.loads import CONTRIBUTIONS
from studies.margin.travel import KINDS, WORDS, Travel

SHADES = (
    "#1f3b73",
    "#3a6ea5",
    "#7fb2d9",
    "#c25b1e",
    "#e59a4b",
    "#7a9a3a",
    "#b6c96a",
    "#4f7f7a",
    "#9fc4bf",
    "#8a6fae",
    "#c94f7c",
)
HIGHEST = 3.0  # times the required margin, or 300 %: above it nothing governs


def margin_figure(travels: Sequence[tuple[str, Travel]]) -> Figure:
    """Contributions of the first law in its governing case, and the margins of all laws.

    Parameters
    ----------
    travels : names of laws and their margins, the result's own first.
    """
    figure = Figure(figsize=(12.0, 4.2), dpi=150, layout="constrained")
    left, *panels = figure.subplots(1, 3, width_ratios=(1.5, 1, 1))
    _, own = travels[0]
    _draw_contributions(left, own)
    for panel, kind in zip(panels, KINDS, strict=True):
        _draw_margins(panel, travels, kind)
    legend_below(figure, panels[0])
    return figure


def _draw_contributions(panel, travel: Travel) -> None:  # type: ignore[no-untyped-def]
    """Factored contributions on top of each other, and what derating leaves of the motor."""
    case, _ = travel.worst("dynamic")
    angle = np.degrees(travel.angle)
    below = np.zeros_like(angle)
    helping = sum(np.minimum(case.parts[name], 0.0) for name in ("inertia", "rotor"))
    for name, shade in zip(CONTRIBUTIONS, SHADES, strict=True):
        part = np.maximum(case.parts[name], 0.0)
        if part.max() > 1e-3 * case.required["dynamic"].max():
            panel.fill_between(angle, below, below + part, color=shade, lw=0, label=WORDS[name])
        below = below + part
    panel.fill_between(angle, helping, 0.0, color=SHADES[0], alpha=0.35, lw=0)
    panel.plot(angle, case.required["dynamic"], color="black", lw=1.2, label="required in motion")
    if travel.available is not None:
        left = travel.available * case.case.derating.whole
        panel.plot(angle, left, color="black", lw=1.2, ls="--", label="available, derated")
    label_axes(panel, "angle α [deg]", "force on each rope [N]")
    panel.set_title(f"factored loads, case '{case.case.name}'", fontsize=10)
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + 0.4 * (high - low))  # room for the legend
    panel.legend(frameon=False, fontsize=8, ncols=2, loc="upper right")


def _draw_margins(  # type: ignore[no-untyped-def]
    panel, travels: Sequence[tuple[str, Travel]], kind: str
) -> None:
    """The margin of each law in its governing case; without a motor, what it would need."""
    for name, travel in travels:
        colour, style = look(name)
        case, k = travel.worst(kind)
        angle = np.degrees(travel.angle)
        rows = 100 * case.margins[kind] if kind in case.margins else case.needed[kind]
        panel.plot(angle, rows, style, color=colour, label=name)
        panel.plot(angle[k], rows[k], "o", color=colour, ms=4)
    _, own = travels[0]
    if own.available is None:
        label_axes(panel, "angle α [deg]", f"motor force needed, {kind} [N]")
        show_lowest(panel)
        return

    required = 100 * own.margin.required[KINDS.index(kind)]
    panel.axhline(required, color="0.4", lw=0.9, ls=":", label="required")
    panel.set_ylim(-100.0, HIGHEST * max(required, 100.0))
    label_axes(panel, "angle α [deg]", f"{kind} margin [%]")
    panel.set_title(f"{kind} margin, governing case", fontsize=10)
