"""A surface in sentences: what it spans, its knee, what more of each limit saves, the laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from studies.common.console import number
from studies.common.result import Verdict
from studies.pareto.columns import FrontAxis
from studies.pareto.surface.shape import Surface, SurfacePoint, reached
from studies.pareto.surface.walk import Stack
from studies.pareto.words import law_beside, price_in_words


@dataclass(frozen=True)
class SurfaceAxes:
    """The three objectives of a surface: sliced, limited from point to point, and least."""

    z: FrontAxis
    x: FrontAxis
    y: FrontAxis

    def at(self, place: Sequence[float], digits: int = 5) -> str:
        """A point with its units."""
        z, x, y = (
            f"{number(value, digits)} {axis.unit}"
            for value, axis in zip(place, (self.z, self.x, self.y), strict=True)
        )
        return f"{z}, {x} and {y}"


def surface_in_words(stack: Stack, axes: SurfaceAxes) -> tuple[str, ...]:
    """What it spans, the knee, the gaps; then what a little more of each limit saves."""
    surface = stack.surface
    points, limits = surface.points, surface.limits
    span = f"on {len(limits)} slices, from {number(limits[0])} to {number(limits[-1])}"
    if len(limits) == 1:
        span = f"on one slice, at {number(limits[0])}"
    sentences = [
        f"The surface has {len(points)} verified points {span} {axes.z.unit} of {axes.z.title}; "
        f"dropped because others dominate them in all three: {len(surface.dominated)}."
    ]
    if len(stack.slices) < stack.wanted:
        sentences.append(f"Of {stack.wanted} slices that were asked for {len(stack.slices)} exist.")
    sentences += [_slice_in_words(surface.slice(limit), axes) for limit in limits]
    if surface.knee is not None:
        knee = points[surface.knee]
        sentences.append(f"The knee is at {axes.at(knee.place)}.")
    sentences += [
        f"The slice at {number(limit)} {axes.z.unit} has a gap between {number(a)} and "
        f"{number(b)} {axes.x.unit}: no point was found there that no other dominates."
        for limit, a, b in surface.gaps
    ]

    priced = [] if surface.knee is None else [points[surface.knee]]
    priced += [surface.slice(limit)[0] for limit in (limits[0], limits[-1])]
    sentences += [prices_at(point, axes) for point in dict.fromkeys(priced)]
    return tuple(sentences)


def sketch_in_words(axes: SurfaceAxes) -> str:
    """How far the points of a sketch are from the least."""
    return (
        f"This is a sketch: the slices begin 2 % above the least {axes.x.title} on them, so that "
        "'drawn' is not the least that there is, and points may be some 0.2 % above the surface."
    )


def _slice_in_words(points: Sequence[SurfacePoint], axes: SurfaceAxes) -> str:
    """Both ends of a slice."""
    first, last = points[0].point, points[-1].point
    head = f"At {number(points[0].limit)} {axes.z.unit}"
    if len(points) == 1:
        return f"{head}: {axes.x.title} {number(first.x)} {axes.x.unit} with {number(first.y)} " + (
            f"{axes.y.unit}, in one point."
        )
    return (
        f"{head}: from {axes.x.title} {number(first.x)} {axes.x.unit} with {number(first.y)} "
        f"{axes.y.unit} to {number(last.x)} {axes.x.unit} with {number(last.y)} {axes.y.unit}."
    )


def prices_at(point: SurfacePoint, axes: SurfaceAxes) -> str:
    """What a little more of either limit saves at a point, by its multiplier."""
    # of a time a tenth of a second: a whole one changes all of a surface
    one = price_in_words(point.limit, point.slope, axes.z, axes.y, of_a_time=0.1)
    inner = point.point
    other = price_in_words(inner.limit, inner.slope, axes.x, axes.y, of_a_time=0.1)
    return f"At {axes.at(point.place)}: {one}, and {other}, at these slopes."


def dominated_in_words(
    surface: Surface,
    name: str,
    place: Sequence[float],
    axes: SurfaceAxes,
    broken: Sequence[str] = (),
) -> str:
    """How the surface compares with a law where it has no more of both limits.

    Parameters
    ----------
    place : the law's three objectives.
    broken : titles of the caps that the law breaks.
    """
    z, x, y = place
    best = reached(surface, z, x)
    return law_beside(
        f"{name} ({axes.at(place)})",
        (None if best is None else best.point.y, y, axes.y.unit),
        ("surface", "of the others", "lies where no point of the surface was looked for"),
        broken,
    )


def surface_verdict(stack: Stack) -> Verdict:
    """Local, or unverified where the user stopped it."""
    count = len(stack.surface.points)
    done = f"{len(stack.slices)} of {stack.wanted} slices"
    if stack.stopped:
        return Verdict("unverified", f"unverified: stopped with {count} points on {done}")
    also = f"; the seconds were over with {done}" if stack.out_of_time else ""
    return Verdict("local", f"local: {count} verified points, none dominates another{also}")
