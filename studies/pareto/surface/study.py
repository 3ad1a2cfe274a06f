"""A trade-off of three objectives from its configuration to its result."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from ocp.arrays import Array
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series, Verdict
from studies.pareto.columns import WAYS, FrontAxis, price_unit
from studies.pareto.config import configuration_of
from studies.pareto.motions import motion_series
from studies.pareto.surface.shape import Box, Surface, SurfacePoint
from studies.pareto.surface.walk import Stack, SurfaceWalk
from studies.pareto.surface.words import SurfaceAxes, dominated_in_words, surface_in_words
from studies.pareto.verdict import BELOW
from studies.truss.checks import broken_caps, table_rows
from studies.truss.limits.bounds import lower_bounds
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import paper_laws
from studies.truss.quantities import OBJECTIVES, QUANTITIES

SAME = 1e-6  # relative: so close to the least is the least
NUMBER = "point"  # the main axis: points are numbered from 1, as their motions are
CURVE = 21  # durations at which a law is drawn, if the duration is traded on each slice


def result_of(walk: SurfaceWalk, stack: Stack) -> Result:
    """The result that a surface gives."""
    study, surface = walk.study, stack.surface
    pareto = study.pareto
    axes = SurfaceAxes(*(_axis(name) for name in pareto.in_order))
    bounds = _bounds(stack)
    chosen = surface.points[len(surface.points) // 2 if surface.knee is None else surface.knee]
    laws = _laws_in(walk, chosen.point.motion.deployment.law.duration)
    minimised = [name for name in pareto.in_order if name in OBJECTIVES]
    free = dataclasses.replace(study.truss, minimise=minimised)
    lowest = lower_bounds(free, None)

    return Result(
        kind="pareto-truss",
        question=study.question,
        configuration=configuration_of(study),
        arrays={
            **surface_series(surface, bounds, axes),
            **_law_series(walk, surface, axes),
            **motion_series([point.point for point in surface.points]),
        },
        table=table_rows(free, [*_shown(surface, chosen, axes), *laws], lowest),
        bounds={key: bound for key, bound in lowest.items() if key in minimised},
        verdict=_verdict(stack),
        checks=_checks(surface, axes, bounds),
        remarks=(
            *surface_in_words(stack, axes),
            *(
                dominated_in_words(surface, law.name, _place(law, axes), axes, _broken(walk, law))
                for law in laws
            ),
            *stack.remarks,
        ),
        details={
            "axes": [vars(axis) for axis in (axes.z, axes.x, axes.y)],
            "bound": "proven: none is below",
            "slices": list(surface.limits),
            "gaps": [list(gap) for gap in surface.gaps],
            "knee": None if surface.knee is None else surface.knee + 1,
            "points": len(surface.points),
            "dominated": len(surface.dominated),
            "solves": walk.alone.solves + sum(one.subject.solves for one in stack.slices),
            "seconds_of_points": sum(
                p.point.seconds for p in (*surface.points, *surface.dominated)
            ),
        },
        provenance=provenance(),
        interrupted=stack.stopped,
    )


def surface_series(surface: Surface, bounds: Array, axes: SurfaceAxes) -> dict[str, Series]:
    """The points of a surface by their numbers, and those that it dominates.

    Parameters
    ----------
    bounds : (points,), nan where there is none.
    """
    points, others = surface.points, surface.dominated
    z, x, y = axes.z, axes.x, axes.y

    def series(unit: str, values: Sequence[float] | Array, meaning: str) -> Series:
        return Series(unit, NUMBER, np.asarray(values), meaning)

    inner, rest = [point.point for point in points], f"dominated {x.key}"
    found = {
        NUMBER: series("1", np.arange(1.0, len(points) + 1), "of a motion, by slices"),
        z.key: series(z.unit, [p.z for p in points], "of the motion, the objective of the slices"),
        x.key: series(x.unit, [p.x for p in inner], "of the motion, limited on each slice"),
        y.key: series(y.unit, [p.y for p in inner], "least under both limits"),
        "slice": series(z.unit, [p.limit for p in points], f"limit on {z.title}"),
        "limit": series(x.unit, [p.limit for p in inner], f"limit on {x.title}"),
        f"price of {z.key}": series(
            price_unit(y, z), [-p.slope for p in points], "what one more of the limit saves"
        ),
        f"price of {x.key}": series(
            price_unit(y, x), [-p.slope for p in inner], "what one more of the limit saves"
        ),
        "bound": series(y.unit, bounds, "that no motion under both limits is below"),
        "way": series(
            "1",
            [WAYS[p.way] for p in inner],
            "1 with rising limits, -1 with falling ones, 0 in a gap",
        ),
        "afresh": series("1", [p.afresh for p in inner], "1 where a neighbour was no start"),
        "seconds": series("s", [p.seconds for p in inner], "that the point took"),
    }
    lost = {axis.key: [p.place[k] for p in others] for k, axis in enumerate((z, x, y))}
    return found | {
        f"dominated {axis.key}": Series(axis.unit, rest, np.array(lost[axis.key]), "of the motion")
        for axis in (x, z, y)
    }


def _axis(name: str) -> FrontAxis:
    return FrontAxis(name, QUANTITIES[name].title, QUANTITIES[name].unit)


def _bounds(stack: Stack) -> Array:
    """What no motion under a point's limits is below; nan where there is no such bound."""
    subjects = {one.limit: one.subject for one in stack.slices}
    return np.array([subjects[p.limit].bound(p.point.x) or np.nan for p in stack.surface.points])


def _laws_in(walk: SurfaceWalk, duration: float) -> tuple[Deployment, Deployment]:
    """The paper's laws in a duration."""
    truss = walk.alone.truss
    return paper_laws(truss.truss, duration, truss.drive, truss.margin)


def _place(law: Deployment, axes: SurfaceAxes) -> tuple[float, float, float]:
    return law.values[axes.z.key], law.values[axes.x.key], law.values[axes.y.key]


def _law_series(walk: SurfaceWalk, surface: Surface, axes: SurfaceAxes) -> Mapping[str, Series]:
    """Where the paper's laws are: at the slices or along curves if the duration is traded."""
    low, high = walk.study.truss.duration
    if axes.z.key == "time":
        durations = list(surface.limits)
    else:
        durations = np.linspace(low, high, CURVE if high > low else 1).tolist()
    pairs = [_laws_in(walk, duration) for duration in durations]
    found = {}
    for laws in zip(*pairs, strict=True):
        name = laws[0].name
        places = np.array([_place(law, axes) for law in laws])
        for k, axis in ((1, axes.x), (0, axes.z), (2, axes.y)):
            along, meaning = f"{name} {axes.x.key}", f"of the {name} law"
            found[f"{name} {axis.key}"] = Series(axis.unit, along, places[:, k], meaning)
    return found


def _shown(surface: Surface, chosen: SurfacePoint, axes: SurfaceAxes) -> list[Deployment]:
    """The motions of the table: the knee, and the least of each objective."""
    middle = "middle" if surface.knee is None else "knee"
    named, box = {middle: chosen}, Box.around([p.place for p in surface.points])
    for k, axis in enumerate((axes.z, axes.x, axes.y)):
        # of equally good ones that which is better in the others
        lowest = min(p.place[k] for p in surface.points) * (1 + SAME)
        least = min(
            (p for p in surface.points if p.place[k] <= lowest),
            key=lambda p: sum(box.parts(p.place)),
        )
        named[f"least {axis.key.removeprefix('peak-')}"] = least
    return [
        dataclasses.replace(point.point.motion.deployment, name=name)
        for name, point in named.items()
    ]


def _broken(walk: SurfaceWalk, law: Deployment) -> tuple[str, ...]:
    """Titles of the caps that a law breaks, all but the limits."""
    broken = broken_caps(walk.alone.truss, law.values)
    return tuple(QUANTITIES[key].title for key in broken if key not in walk.study.pareto.objectives)


def _verdict(stack: Stack) -> Verdict:
    """Local, or unverified where the user stopped it."""
    count = len(stack.surface.points)
    done = f"{len(stack.slices)} of {stack.wanted} slices"
    if stack.stopped:
        return Verdict("unverified", f"unverified: stopped with {count} points on {done}")
    also = f"; the seconds were over with {done}" if stack.out_of_time else ""
    return Verdict("local", f"local: {count} verified points, none dominates another{also}")


def _checks(surface: Surface, axes: SurfaceAxes, bounds: Array) -> tuple[Criterion, ...]:
    """That no point is below its bound; each point itself was held against all that it has to."""
    count = float(len(surface.points))
    name = "points of the surface whose motion meets all its checks"
    checks = [Criterion(name, "1", count, count, True)]
    values, known = np.array([p.point.y for p in surface.points]), np.isfinite(bounds)
    if known.any():
        below = float((1 - values[known] / bounds[known]).max())
        name = f"{axes.y.title} below its bound"
        checks.append(Criterion(name, "of the bound", below, BELOW, below <= BELOW))
    return tuple(checks)
