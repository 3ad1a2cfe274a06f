"""What a surface of the truss gives as a result."""

from __future__ import annotations

import dataclasses

import numpy as np

from studies.common.comparison_table import costs_elsewhere
from studies.common.folder import provenance
from studies.common.result import Result
from studies.common.stops import kept
from studies.pareto.config import configuration_of
from studies.pareto.laws import DRAWN, axis_of, broken_titles, compared, laws_in
from studies.pareto.motions import motion_series
from studies.pareto.surface.columns import (
    surface_bounds,
    surface_details,
    surface_law_series,
    surface_series,
)
from studies.pareto.surface.shape import Surface, SurfacePoint, middle_of, named_points
from studies.pareto.surface.truss import TrussSurface
from studies.pareto.surface.walk import Stack
from studies.pareto.surface.words import (
    SurfaceAxes,
    dominated_in_words,
    sketch_in_words,
    surface_in_words,
    surface_verdict,
)
from studies.pareto.verdict import checks_of_points
from studies.truss.motions.deployment import Deployment


def result_of(sliced: TrussSurface, stack: Stack) -> Result:
    """The result that a surface gives."""
    return kept(lambda whole: _result(sliced, stack, whole), stack.stopped)


def _result(sliced: TrussSurface, stack: Stack, whole: bool) -> Result:
    """The result; the whole one has the curves of the laws, and else their points."""
    study, surface = sliced.study, stack.surface
    pareto = study.pareto
    axes = SurfaceAxes(*(axis_of(name) for name in pareto.in_order))
    bounds = surface_bounds(stack)
    chosen = middle_of(surface)
    laws = laws_in(sliced.alone.truss, chosen.point.motion.deployment.law.duration)
    motion, *ends = _shown(surface, chosen, axes, drawn=pareto.coarse)
    table, proven = compared(study.truss, pareto.in_order, [motion, *ends, *laws])
    also_found = tuple(end.name for end in ends)
    places = {law.name: [_place(law, axes)] for law in laws}
    if whole:
        places = _places(sliced, surface, axes)

    return Result(
        kind="pareto-truss",
        question=study.question,
        configuration=configuration_of(study),
        arrays={
            **surface_series(surface, bounds, axes),
            **surface_law_series(places, axes),
            **motion_series([point.point for point in surface.points]),
        },
        table=table,
        also_found=also_found,
        costs_elsewhere=costs_elsewhere(table, also_found),
        bounds=proven,
        verdict=surface_verdict(stack),
        checks=checks_of_points(
            "surface", [point.point.y for point in surface.points], axes.y.title, bounds
        ),
        remarks=(
            *surface_in_words(stack, axes),
            *((sketch_in_words(axes),) if pareto.coarse else ()),
            *(
                dominated_in_words(
                    surface,
                    law.name,
                    _place(law, axes),
                    axes,
                    broken_titles(sliced.alone.truss, law, sliced.study.pareto.objectives),
                )
                for law in laws
            ),
            *stack.remarks,
        ),
        details={
            **surface_details(stack, axes),
            "solves": sliced.alone.solves + sum(one.subject.solves for one in stack.slices),
        },
        provenance=provenance(),
    )


def _place(law: Deployment, axes: SurfaceAxes) -> tuple[float, float, float]:
    return law.values[axes.z.key], law.values[axes.x.key], law.values[axes.y.key]


def _places(
    sliced: TrussSurface, surface: Surface, axes: SurfaceAxes
) -> dict[str, list[tuple[float, float, float]]]:
    """Where the paper's laws are: at the slices or along curves if the duration is traded."""
    low, high = sliced.study.truss.duration
    if axes.z.key == "time":
        durations = list(surface.limits)
    else:
        durations = np.linspace(low, high, DRAWN if high > low else 1).tolist()
    pairs = [laws_in(sliced.alone.truss, duration) for duration in durations]
    only = frozenset(axis.key for axis in (axes.x, axes.y, axes.z))
    return {
        laws[0].name: [_place(dataclasses.replace(law, only=only), axes) for law in laws]
        for laws in zip(*pairs, strict=True)
    }


def _shown(
    surface: Surface, chosen: SurfacePoint, axes: SurfaceAxes, *, drawn: bool
) -> list[Deployment]:
    """The motions of the table: the knee, and the least of each objective; of a sketch as drawn."""
    named = named_points(surface, chosen, [axis.key for axis in (axes.z, axes.x, axes.y)])
    return [
        dataclasses.replace(
            point.point.motion.deployment,
            name=f"{name} drawn" if drawn and name.startswith("least") else name,
        )
        for name, point in named.items()
    ]
