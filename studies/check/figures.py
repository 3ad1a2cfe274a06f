"""Figures of a check: the file's rows and what is left of them, and the motion beside others.

Every figure is drawn from a result, whether it was just made or loaded.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from models.laws import Hermite
from ocp.arrays import Array
from studies.common.drawing import label_axes, legend_below
from studies.common.result import Result
from studies.truss.config import TrussStudy, study_from
from studies.truss.figures import (
    force_figure,
    label_times,
    overview_figure,
    rope_figure,
    styled,
    times,
)
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import BEFORE, RATES, paper_laws_of, stored_law

OPTIMUM = "optimal"
ROUNDING = 1e-6  # [mrad], below which a distance of rows that are taken as exact is rounding
SHADE = 0.25  # of a band


def draw(result: Result) -> Iterator[tuple[str, Figure]]:
    """Every figure of a check with the name of its file."""
    if result.kind == "check-arm":
        from studies.arm.report.figures import motion_figures

        yield from motion_figures(result)
        return

    study = study_from(result.configuration)
    columns = {name: series.values for name, series in result.arrays.items()}
    laws = deployments_of(result)
    yield "rows", rows_figure(result, laws[0], columns)
    yield "motion", motion_figure(study, laws, columns)
    yield "rope", rope_figure(laws)
    yield "force", force_figure(laws)
    yield "overview", overview_figure(laws)


def deployments_of(result: Result) -> list[Deployment]:
    """The profile, the optimum where there is one, and the paper's laws."""
    study = study_from(result.configuration)
    columns = {name: series.values for name, series in result.arrays.items()}
    law = stored_law(columns)
    laws = [Deployment(result.laws[0], law, study.truss)]
    if f"{OPTIMUM}/time" in columns:
        time, angle, speed, after, before = (
            columns[f"{OPTIMUM}/{name}"] for name in ("time", "angle", *RATES, BEFORE)
        )
        best = Hermite(time, angle, speed, after, before)
        laws.append(Deployment(OPTIMUM, best, study.truss))
    return [*laws, *paper_laws_of(study, law.duration)]


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
    study: TrussStudy, laws: list[Deployment], columns: Mapping[str, Array]
) -> Figure:
    """Angle, speed and acceleration of all laws, with the profile's bands and the caps."""
    figure = Figure(figsize=(12.9, 3.8), dpi=150, layout="constrained")
    figure.suptitle(f"{laws[0].name} compared with the optimum and the paper's laws", fontsize=12)
    axes = list(figure.subplots(1, 3))
    for deployment, colour, style in styled(laws):
        t = times(deployment)
        motion = deployment.law.motion(t)
        histories = (np.degrees(motion.angle), motion.speed, motion.acceleration)
        for panel, history in zip(axes, histories, strict=True):
            panel.plot(t, history, style, color=colour, label=deployment.name)
        if deployment is laws[0] and "band/time" in columns:
            _shade(axes, deployment, columns, colour)

    for panel, cap in zip(axes[1:], (study.caps.speed, study.caps.acceleration), strict=True):
        for sign in (1, -1) if cap is not None else ():
            panel.axhline(sign * cap, color="0.4", lw=0.8, ls=":")  # type: ignore[operator]
    label_times(axes, ("angle α [deg]", "angular speed [rad/s]", "angular acceleration [rad/s²]"))
    legend_below(figure, axes[0])
    return figure


def _shade(axes: list[Any], profile: Deployment, columns: Mapping[str, Array], colour: str) -> None:
    t = columns["band/time"]
    motion = profile.law.motion(np.minimum(t, profile.law.duration))
    for panel, values, name in (
        (axes[1], motion.speed, "speed"),
        (axes[2], motion.acceleration, "acceleration"),
    ):
        width = columns[f"band/{name}"]
        panel.fill_between(t, values - width, values + width, color=colour, alpha=SHADE, lw=0)
