"""Figures of a co-design: the force of both designs, the parameters in their range, the prices."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from studies.codesign.config import UNITS, study_from
from studies.codesign.search import STATED
from studies.common.drawing import COLOURS, label_axes
from studies.common.result import Result
from studies.truss.figures import draw as draw_truss

OWN, BEFORE = COLOURS[0], COLOURS[1]


def draw(result: Result) -> Iterator[tuple[str, Figure]]:
    """The figure of the co-design, then those of any motion of the truss."""
    yield "codesign", codesign_figure(result)
    yield from draw_truss(result)


def codesign_figure(result: Result) -> Figure:
    """Rope force against the angle, parameters in their range, and what each bound is worth."""
    figure = Figure(figsize=(13.0, 4.4), dpi=150, layout="constrained")
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.2, 1, 1.1))
    _draw_forces(left, result)
    _draw_design(middle, result)
    _draw_prices(right, result.details["prices"])
    return figure


def _draw_forces(panel: Axes, result: Result) -> None:
    for name, colour, style, label in (
        ("", OWN, "-", "co-design"),
        (f"{STATED}/", BEFORE, "--", STATED),
    ):
        angle = np.degrees(result.arrays[f"{name}angle"].values)
        force = result.arrays[f"{name}motor_force"].values
        panel.plot(angle, force, style, color=colour, label=f"{label}: {force.max():.4g} N")
    label_axes(panel, "deployment angle α [deg]", "force of the motor on one rope [N]")
    panel.set_title("rope force, each design in its best motion", fontsize=10)
    panel.legend(frameon=False, loc="upper left")


def _draw_design(panel: Axes, result: Result) -> None:
    """Each free parameter between its limits, as a part of its given value."""
    study = study_from(result.configuration)
    limits = study.design.limits(study.deployment.truss)
    for place, (name, (low, high)) in enumerate(limits.items()):
        stated = float(getattr(study.deployment.truss, name))
        found = float(result.details["design"][name])
        panel.plot([low / stated, high / stated], [place, place], color="0.8", lw=6, zorder=1)
        panel.plot([1.0], [place], "|", color=BEFORE, ms=18, mew=2.5)
        panel.plot([found / stated], [place], "o", color=OWN, ms=8)
        panel.annotate(
            f"{found:.4g} {UNITS[name]}",
            (found / stated, place),
            textcoords="offset points",
            xytext=(0, 13),  # above the tick
            ha="center",
        )
    label_axes(panel, "fraction of the given value [-]", "")
    panel.set_yticks(range(len(limits)), [name.replace("_", "\n") for name in limits])
    panel.set_ylim(len(limits) - 0.5, -0.6)
    panel.margins(x=0.12)
    panel.set_title("co-design (dot), given (tick), range (bar)", fontsize=10)


def _draw_prices(panel: Axes, prices: list[Mapping[str, Any]]) -> None:
    """What one per cent more room at each pressing bound saves."""
    saved = [abs(price["price"] * price["limit"]) / 100 for price in prices]
    panel.barh(range(len(prices)), saved, color=OWN, height=0.55)
    label_axes(panel, "force reduction by a 1 % looser bound [N]", "")
    panel.xaxis.set_major_locator(MaxNLocator(5))
    words = [f"{price['title']}\n{_side(price)}" for price in prices]
    panel.set_yticks(range(len(prices)), words)
    panel.invert_yaxis()
    panel.set_title("shadow prices of the active bounds", fontsize=10)


def _side(price: Mapping[str, Any]) -> str:
    sign = "≥" if price["side"] == "lower" else "≤"
    unit = "" if price["unit"] == "1" else f" {price['unit']}"
    return f"{sign} {price['limit']:.4g}{unit}"
