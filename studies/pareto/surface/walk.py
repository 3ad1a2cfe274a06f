"""From slice to slice: which limit comes next, how far the work is, what is kept where it ends.

The slice with the highest limit comes first, since most is allowed there, then the one with the
lowest. Each further one halves the gap between two neighbours, those that are furthest apart.
"""

from __future__ import annotations

import itertools
import math
import time as clock
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from ocp.analysis.front.both_ways import LENGTH, WIDEST, Walked
from ocp.analysis.front.continuation import LONGEST, FrontPoint, NotFoundError, Subject
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.pareto.columns import FrontAxis
from studies.pareto.keys import SLICE
from studies.pareto.surface.shape import Box, Surface, SurfacePoint, apart, surface_of

SLICES, COARSE_SLICES = 7, 4  # where nothing is stated
COARSE_POINTS = 4
ABOVE = 0.02  # of the least: where the lowest slice is, for at the least nothing can be traded


class OutOfTimeError(KeyboardInterrupt):
    """The seconds of a surface are over; walks keep what they have, as where the user stops."""


class SliceSubject(Subject, Protocol):
    """What a slice is of: a front under one limit on the sliced objective."""

    solves: int

    @property
    def level(self) -> float:
        """The limit of the slice."""
        ...

    def on_surface(self, point: FrontPoint) -> SurfacePoint:
        """A point of the slice with its third objective, and the price of the slice's limit."""
        ...

    def bound(self, x: float) -> float | None:
        """What no motion of the slice with at most an x is below; None where nothing is known."""
        ...


@dataclass(frozen=True, eq=False)
class Slice:
    """A slice that was walked.

    Attributes
    ----------
    subject : whose limit of the slice it has.
    left, right : its ends.
    walked : its front, and how it came about.
    """

    subject: SliceSubject
    left: FrontPoint
    right: FrontPoint
    walked: Walked

    @property
    def limit(self) -> float:
        """On what is sliced."""
        return self.subject.level

    def points(self) -> list[SurfacePoint]:
        """All its points, with what each has of the sliced objective."""
        front = self.walked.front
        return [self.subject.on_surface(point) for point in (*front.points, *front.dominated)]


@dataclass(frozen=True)
class SliceRequest:
    """How a surface is to be sliced.

    Attributes
    ----------
    axis : what is sliced.
    stated : limits of the slices, rising; empty where the walk chooses them.
    wanted : how many slices there are to be.
    count : points that a walk along a slice may take.
    seconds : that all slices may take.
    each : seconds that a slice with `usual` points takes on one core of 2.5 GHz, for the first line
        of progress; later lines count what the slices before have taken.
    """

    axis: FrontAxis
    stated: tuple[float, ...]
    wanted: int
    count: int
    seconds: float
    each: float
    usual: int

    @classmethod
    def of(
        cls,
        axis: FrontAxis,
        slices: int | tuple[float, ...] | None,
        points: int | None,
        *,
        coarse: bool,
        seconds: float,
        each: tuple[float, float],
    ) -> SliceRequest:
        """What the keys of a trade-off ask for; `each` of a full slice and of a sketch's."""
        stated = slices if isinstance(slices, tuple) else ()
        wanted = slices if isinstance(slices, int) else COARSE_SLICES if coarse else SLICES
        count = points or SLICE
        return cls(
            axis,
            stated,
            len(stated) or wanted,
            min(count, COARSE_POINTS) if coarse else count,
            seconds,
            each[coarse],
            COARSE_POINTS if coarse else SLICE,
        )


class Sliced(Protocol):
    """What a surface is of."""

    request: SliceRequest

    def ends(self) -> tuple[float, float]:
        """Lowest and highest limit of the slices; raises StudyError if nothing is between them."""
        ...

    def walk(self, limit: float, neighbours: Sequence[Slice], until: float) -> Slice:
        """A slice from its neighbours, the one with the higher limit first, or from searches.

        It raises `OutOfTimeError` when the monotonic clock passes `until`, and `NotFoundError` or
        `StudyError` if the slice has no motion.
        """
        ...


@dataclass(frozen=True, eq=False)
class Stack:
    """The slices of a surface.

    Attributes
    ----------
    slices : that were walked, by rising limit.
    surface : of all their points.
    wanted : how many slices there were to be.
    remarks : sentences on slices and limits at which nothing was found.
    stopped : whether the user stopped the work.
    out_of_time : whether the seconds of the study were over before its end.
    """

    slices: tuple[Slice, ...]
    surface: Surface
    wanted: int
    remarks: tuple[str, ...]
    stopped: bool
    out_of_time: bool


class SurfaceWalk:
    """What is sliced, on its way to a surface."""

    def __init__(self, sliced: Sliced, console: Console) -> None:
        self.sliced, self.console, self.request = sliced, console, sliced.request
        self.begin = clock.monotonic()
        self.tried: list[float] = []
        self.slices: list[Slice] = []
        self.remarks: list[str] = []

    def run(self) -> Stack:
        """Walk the slices.

        Raises
        ------
        StudyError
            If no slice has a motion, or the work was stopped before there was one.
        """
        self._foretell()
        stopped = out_of_time = False
        try:
            for limit in self._limits():
                self._walk(limit)
        except OutOfTimeError:
            out_of_time = True
        except KeyboardInterrupt:
            stopped = True

        if not self.slices:
            raise StudyError(
                "stopped before a slice was found; the inputs are kept"
                if stopped
                else f"no slice was found in {self.request.seconds:g} s; give it more: --seconds",
                ExitCode.INTERRUPTED if stopped else ExitCode.NOT_SOLVED,
            )
        points = [point for one in self.slices for point in one.points()]
        surface = surface_of(points, WIDEST * LENGTH / self.request.count)
        remarks = tuple(self.remarks)
        return Stack(
            tuple(self.slices), surface, self.request.wanted, remarks, stopped, out_of_time
        )

    def _foretell(self) -> None:
        """Say how long it will take."""
        asked = self.request
        fewest = 1 / LONGEST  # points of a walk, however few are asked for
        share = max(asked.count, fewest) / max(asked.usual, fewest)
        self.console.progress(
            f"{asked.wanted} slices of the {asked.axis.title}, which takes about "
            f"{in_words(asked.wanted * asked.each * share)} where a core is free, at times twice "
            "that; each slice tells what is left"
        )

    def _limits(self) -> Iterator[float]:
        """The limits of the slices, one after the other."""
        if self.request.stated:
            yield from reversed(self.request.stated)
            return
        low, high = self.sliced.ends()
        yield high
        yield low
        while len(self.tried) < self.request.wanted:
            yield self._between()

    def _between(self) -> float:
        """The middle of the two neighbours that are furthest apart."""
        box = Box.around([p.place for one in self.slices for p in one.points()])
        known = {one.limit: one.walked.front for one in self.slices}

        def distance(pair: tuple[float, float]) -> float:
            a, b = pair
            along = box.across.place(b, 0.0)[0] - box.across.place(a, 0.0)[0]
            if a not in known or b not in known:
                return along
            return math.hypot(along, apart(known[a], known[b], box.front))

        a, b = max(itertools.pairwise(sorted(self.tried)), key=distance)
        return math.sqrt(a * b) if box.across.logarithmic else (a + b) / 2

    def _walk(self, limit: float) -> None:
        """Walk a slice from its neighbours, and keep what was found of it.

        Raises
        ------
        StudyError
            If the first slice has no motion.
        OutOfTimeError, KeyboardInterrupt
            If that ended the slice; its points are kept.
        """
        self.tried.append(limit)
        axis = self.request.axis
        name = f"{axis.title} {limit:.5g} {axis.unit}"
        self.console.progress(f"slice {len(self.tried)} of {self.request.wanted}: {name}")
        try:
            found = self.sliced.walk(limit, self._neighbours(limit), self._until)
        except (NotFoundError, StudyError) as error:
            if isinstance(error, StudyError) and error.exit_code is ExitCode.INTERRUPTED:
                raise KeyboardInterrupt from error
            if not self.slices:
                raise StudyError(
                    f"no motion was found on the first slice, {name}: {error}", ExitCode.NOT_SOLVED
                ) from error
            self.remarks.append(f"The slice at {name} was left out: {error}.")
            return

        self.slices = sorted([*self.slices, found], key=lambda one: one.limit)
        self.remarks += [f"On the slice at {name} {remark}." for remark in found.walked.remarks]
        self._told(len(found.walked.front.points))
        if found.walked.stopped:
            raise OutOfTimeError if clock.monotonic() > self._until else KeyboardInterrupt

    @property
    def _until(self) -> float:
        return self.begin + self.request.seconds

    def _neighbours(self, limit: float) -> list[Slice]:
        """The slices next to a limit, the one with the higher limit first."""
        above = [one for one in self.slices if one.limit > limit][:1]
        below = [one for one in self.slices if one.limit < limit][-1:]
        return [*above, *below]

    def _told(self, points: int) -> None:
        """Say what a slice gave, and what is left to do."""
        left, spent = self.request.wanted - len(self.tried), clock.monotonic() - self.begin
        about = in_words(spent / len(self.tried) * left)
        rest = f"{left} left, about {about}" if left else "it was the last one"
        self.console.progress(f"slice {len(self.tried)}: {points} points; {rest}")


def in_words(seconds: float) -> str:
    """A time as one says it."""
    return f"{seconds:.0f} s" if seconds < 100.0 else f"{seconds / 60:.0f} min"
