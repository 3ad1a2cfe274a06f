"""Still pictures of a page, as SVG in the page's own colours: for printers and without scripts."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from ocp.arrays import Array
from studies.common.charts import Chart, value_range, written_unit
from studies.common.console import number
from studies.common.drawing import COLOURS, STYLES, label_axes
from studies.common.scene.moving_picture import LawOfMotion, MovingPicture
from studies.common.scene.projection import View, outline, project
from studies.report.html import from_svg

SIZE = (6.2, 2.7)  # inches, of a chart
MOST_CURVES = 12
_INK, _GRID, _CAP = "#1b1f24", "#d9dde2", "#6b7280"  # each stands for a colour of the page
_VARIABLES = {
    _INK: "var(--ink)",
    _GRID: "var(--grid)",
    _CAP: "var(--cap)",
    **{colour: f"var(--law-{k})" for k, colour in enumerate(COLOURS)},
}
_SETTINGS: dict[str, Any] = {
    "svg.fonttype": "none",  # text stays text
    "font.size": 9,
    "path.simplify_threshold": 0.25,  # of a pixel
    "text.color": _INK,
    "axes.labelcolor": _INK,
    "axes.edgecolor": _INK,
    "xtick.color": _INK,
    "ytick.color": _INK,
    "axes.formatter.useoffset": False,
}
SNAPSHOT_SIZE = 220  # of the side of a snapshot, in units of its SVG


def chart_picture(chart: Chart, laws: Sequence[str]) -> Markup:
    """A chart over its usual axis."""
    with mpl.rc_context(_settings(chart.key)):
        figure = Figure(figsize=SIZE)
        panel = figure.subplots()
        axis = chart.axes[0]
        for curve in chart.curves[:MOST_CURVES]:
            k = laws.index(curve.law) % len(COLOURS)
            places = curve.places[axis.key]
            panel.plot(places, curve.values, STYLES[k], color=COLOURS[k], lw=1.6)
        for level in chart.levels:
            panel.axhline(level.value, color=_CAP, lw=1.0, ls=(0, (2, 2)))

        label_axes(
            panel,
            axis.label,
            chart.label if len(chart.label) < 28 else f"[{written_unit(chart.unit)}]",
        )
        _tidy(figure, panel)
        values = [v for curve in chart.curves for v in (curve.values.min(), curve.values.max())]
        low, high = value_range([*values, *(level.value for level in chart.levels)])
        panel.set_ylim(low - 0.05 * (high - low), high + 0.05 * (high - low))
        return _in_page_colours(figure, f"{chart.label} against {axis.label}")


def _tidy(figure: Figure, panel: Axes) -> None:
    """The page's colours, plain numbers, and margins that need not be worked out.

    Typeset numbers and a layout that is solved for would take ten times as long.
    """
    panel.grid(color=_GRID, lw=0.6)
    panel.patch.set_visible(False)
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: number(value, 4)))
    figure.subplots_adjust(left=0.125, right=0.985, top=0.965, bottom=0.175)


def _settings(key: str) -> Any:
    """Settings of Matplotlib; identifiers of its elements differ from picture to picture."""
    return {**_SETTINGS, "svg.hashsalt": key}


def _in_page_colours(figure: Figure, title: str) -> Markup:
    stream = io.StringIO()
    figure.savefig(stream, format="svg", transparent=True, metadata={"Date": None})
    text = stream.getvalue()
    for colour, variable in _VARIABLES.items():
        text = text.replace(colour, variable)
    text = re.sub(r"'DejaVu Sans', [^;\"]*", "sans-serif", text)
    return from_svg(text[text.index("<svg") :], title)


@dataclass(frozen=True)
class StillFrame:
    """A motion at an instant.

    Attributes
    ----------
    box : of its SVG, as that states it.
    title : for who cannot see it.
    caption : below it.
    strands : class and path of each kind.
    """

    box: str
    title: str
    caption: str
    strands: tuple[tuple[str, str], ...]


def snapshots(picture: MovingPicture, shares: Sequence[float]) -> list[StillFrame]:
    """The first law's motion at shares of its duration, each with a caption."""
    law = picture.laws[0]
    view = View.flat() if picture.flat else View()
    return [_snapshot(picture, law, float(share * law.times[-1]), view) for share in shares]


def _snapshot(picture: MovingPicture, law: LawOfMotion, time: float, view: View) -> StillFrame:
    value = law.at(time)
    points = project(picture.points(value), view)
    frame = outline(picture, view)
    scale = SNAPSHOT_SIZE / max(frame.width, frame.height)
    middle = points[picture.centre] if picture.centre >= 0 else frame.middle
    screen = (points[:, :2] - middle[:2]) * (scale, -scale)

    strands = [
        (strand.kind.replace(" ", "-"), _path(screen, strand.pairs)) for strand in picture.strands
    ]
    if picture.tension is not None:
        for rope in picture.tension.paths:
            strands.append(("rope", _path(screen, np.stack([rope[:-1], rope[1:]], axis=1))))

    width, height = frame.width * scale + 16, frame.height * scale + 16
    caption = f"t = {time:.4g} s"
    if not picture.flat:
        caption += f", {np.degrees(value):.1f}°"
    return StillFrame(
        box=f"{-width / 2:.1f} {-height / 2:.1f} {width:.1f} {height:.1f}",
        title=f"{picture.title} at {caption}",
        caption=caption,
        strands=tuple(strands),
    )


def _path(screen: Array, pairs: Array) -> str:
    ends = screen[pairs]
    return "".join(f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" for (a, b), (c, d) in ends)


def tension_picture(picture: MovingPicture) -> Markup:
    """Tension of every segment of a rope at the start, half time, peak force and end."""
    law, tension = picture.laws[0], picture.tension
    assert tension is not None
    moments = {
        "start": 0.0,
        "half time": float(law.times[-1]) / 2,
        "peak force": float(law.times[int(np.argmax(law.force))]),
        "end": float(law.times[-1]),
    }
    with mpl.rc_context(_settings("tension")):
        figure = Figure(figsize=SIZE)
        panel = figure.subplots()
        segments = np.arange(1, len(tension.exponents) + 1)
        for k, (name, time) in enumerate(moments.items()):
            force = float(np.interp(time, law.times, law.force))
            values = force * np.exp(tension.exponents @ [1.0, law.at(time)])
            label = f"{name}, {time:.4g} s"
            panel.plot(segments, values, STYLES[k], color=COLOURS[k], label=label)
        label_axes(panel, "segment, from the motor", "tension [N]")
        _tidy(figure, panel)
        panel.set_ylim(bottom=0)
        panel.legend(frameon=False, fontsize=8)
        return _in_page_colours(figure, "tension along one rope at four instants")
