"""Figures of a check: the file's rows and what is left of them, and the motion beside others.

Every figure is drawn from a result, whether it was just made or loaded.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from ocp.arrays import Array
from studies.common.drawing import label_axes, look
from studies.common.result import Result
from studies.truss.figures import angle_figure, force_figure, overview_figure, rope_figure, times
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import deployments_of

ROUNDING = 1e-6  # [mrad], below which a distance of rows that are taken as exact is rounding
SHADE = 0.25  # of a band


def draw(result: Result) -> Iterator[tuple[str, Figure]]:
    """Every figure of a check with the name of its file."""
    if result.kind == "check-arm":
        from studies.arm.report.figures import motion_figures

        yield from motion_figures(result)
        return

    columns = {name: series.values for name, series in result.arrays.items()}
    caps = {row.key: row.cap for row in result.table if row.cap is not None}
    laws = deployments_of(result)
    yield "rows", rows_figure(result, laws[0], columns)
    yield "motion", motion_figure(laws, caps, columns)
    yield "rope", rope_figure(laws, caps)
    yield "force", force_figure(laws, caps)
    yield "overview", overview_figure(laws, caps)


def rows_figure(result: Result, profile: Deployment, columns: Mapping[str, Array]) -> Figure:
    """The rows of the file with the curve through them, and their distances from it."""
    time, rows = columns["rows/time"], columns["rows/angle"]
    figure = Figure(figsize=(8.6, 3.9), dpi=150, layout="constrained")
    noise = result.details["noise"]
    smoothed = "smoothed" if noise["matters"] else "taken as exact"
    figure.suptitle(f"{profile.name}: rows of the file, {smoothed}", fontsize=12)
    angles, left = figure.subplots(1, 2)

    angles.plot(time, np.degrees(rows), ".", color="0.6", ms=3, label="rows")
    grid = times(profile)
    curve = np.degrees(profile.law.motion(grid).angle)
    angles.plot(grid, curve, color="#0b5fa5", lw=1.2, label="recovered motion")

    distance = rows - profile.law.motion(np.minimum(time, profile.law.duration)).angle
    left.plot(time, 1e3 * distance, ".", color="0.4", ms=3, label="row minus recovered motion")
    if "band/time" in columns:
        width = 1e3 * columns["band/angle"]
        name = "band of the true motion, 95 %"
        blue = {"color": "#0b5fa5", "alpha": 0.3, "lw": 0, "zorder": 1}  # behind the rows
        left.fill_between(columns["band/time"], -width, width, label=name, **blue)
    label_axes(angles, "time [s]", "angle [deg]")
    label_axes(left, "time [s]", "distance [mrad]")
    low, high = left.get_ylim()
    if max(-low, high) < ROUNDING:  # nothing to see but the last bit
        left.set_ylim(-ROUNDING, ROUNDING)
    for panel in (angles, left):
        # below: rows are everywhere, and a legend among them hides some
        below = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16)}
        panel.legend(**below, frameon=False, fontsize=8)
    return figure


def motion_figure(
    laws: Sequence[Deployment], caps: Mapping[str, float], columns: Mapping[str, Array]
) -> Figure:
    """Angle, speed and acceleration of all laws, with the profile's bands and the caps."""
    figure, law = angle_figure(laws, caps), laws[0].law
    if "band/time" not in columns:
        return figure
    t = columns["band/time"]
    motion, (colour, _) = law.motion(np.minimum(t, law.duration)), look(laws[0].name)
    _, *panels = figure.axes
    for panel, name in zip(panels, ("speed", "acceleration"), strict=True):
        values, width = getattr(motion, name), columns[f"band/{name}"]
        panel.fill_between(t, values - width, values + width, color=colour, alpha=SHADE, lw=0)
    return figure
