"""From slice to slice: which limit comes next, how far the work is, what is kept where it ends.

The slice with the highest limit comes first, since most is allowed there, then the one with the
lowest. Each further one halves the gap between two neighbours, those that are furthest apart.
"""

from __future__ import annotations

import itertools
import math
import time as clock
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from models.laws import least_jerk_cap
from ocp import Constant
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.pareto.both_ways import LENGTH, WIDEST
from studies.pareto.config import SLICE, ParetoStudy
from studies.pareto.continuation import LONGEST, NotFoundError
from studies.pareto.surface.shape import Box, Surface, apart, surface_of
from studies.pareto.surface.slices import OutOfTimeError, Slice, SliceFront
from studies.pareto.truss import TrussFront, limited
from studies.truss.limits.caps import cap_on
from studies.truss.motions.deployment import Deployment
from studies.truss.quantities import OBJECTIVES, QUANTITIES
from studies.truss.search.motion_search import Search

SLICES, COARSE_SLICES = 7, 4  # where nothing is stated
COARSE_POINTS = 4
ABOVE = 0.02  # of the least: where the lowest slice is, for at the least nothing can be traded
# what a slice with as many points as is usual takes on one core of 2.5 GHz, for the first line of
# progress; later lines count what the slices before have taken
SECONDS, COARSE_SECONDS = 45.0, 15.0


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
    """A study of three objectives on its way to a surface."""

    def __init__(self, study: ParetoStudy, console: Console) -> None:
        pareto = study.pareto
        assert pareto.sliced is not None
        self.study, self.console, self.sliced = study, console, pareto.sliced
        self.quantity = QUANTITIES[pareto.sliced]
        self.alone = TrussFront(study, console)  # without a limit on what is sliced
        self.stated = pareto.slices if isinstance(pareto.slices, tuple) else ()
        usual = COARSE_SLICES if pareto.coarse else SLICES
        self.wanted = len(self.stated) or pareto.slices or usual
        self.count = pareto.points or SLICE
        if pareto.coarse:
            self.count = min(self.count, COARSE_POINTS)
        self.begin = clock.monotonic()
        self.tried: list[float] = []
        self.slices: list[Slice] = []
        self.remarks: list[str] = []

    def check(self) -> None:
        """Refuse what no motion meets, and an objective that no motion minimises.

        Raises
        ------
        StudyError
            As a study of the truss says it.
        """
        self.alone.check()
        if self.sliced in OBJECTIVES:
            Search(self.alone.minimising(self.sliced), self.console).check()
        if self.sliced == "peak-jerk" and self._highest is None and not self.stated:
            raise StudyError(
                "slices of the jerk need its highest value; state a jerk cap, as --jerk-cap 500/T^3"
                ", or the limits: --slices LOW,...,HIGH"
            )
        for limit in self.stated:
            Search(limited(self.alone.truss, self.sliced, limit), self.console).check()

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
                else f"no slice was found in {self.study.truss.solver.seconds:g} s; give it more: "
                "--seconds",
                ExitCode.INTERRUPTED if stopped else ExitCode.NOT_SOLVED,
            )
        points = [point for one in self.slices for point in one.points()]
        surface = surface_of(points, WIDEST * LENGTH / self.count)
        remarks = tuple(self.remarks)
        return Stack(tuple(self.slices), surface, self.wanted, remarks, stopped, out_of_time)

    def _foretell(self) -> None:
        """Say how long it will take."""
        coarse = self.study.pareto.coarse
        each, usual = (COARSE_SECONDS, COARSE_POINTS) if coarse else (SECONDS, SLICE)
        fewest = 1 / LONGEST  # points of a walk, however few are asked for
        about = in_words(self.wanted * each * max(self.count, fewest) / max(usual, fewest))
        self.console.progress(
            f"{self.wanted} slices of the {self.quantity.title}, which takes about {about} where a "
            "core is free"
        )

    def _limits(self) -> Iterator[float]:
        """The limits of the slices, one after the other."""
        if self.stated:
            yield from reversed(self.stated)
            return
        low, high = self._ends()
        yield high
        yield low
        while len(self.tried) < self.wanted:
            yield self._between()

    def _ends(self) -> tuple[float, float]:
        """The lowest and the highest limit.

        Raises
        ------
        StudyError
            If there is nothing between them.
        """
        least = self._lowest
        shortest = self.study.truss.duration[0]
        # a shortest duration that is stated is no least of the mechanism, and leaves room
        bounded = self.sliced == "time" and least <= shortest * (1 + 1e-6)
        low = shortest if bounded else least * (1 + ABOVE)
        high = self._highest
        if high is None:
            pareto = self.study.pareto
            both = (self._value_of_the_least(name) for name in (pareto.limited, pareto.least))
            high = max(both)
        if high <= low * (1 + ABOVE):
            raise StudyError(
                f"there is nothing to trade: the {self.quantity.title} is {least:.6g} "
                f"{self.quantity.unit} at least, and {high:.6g} {self.quantity.unit} is all that "
                "the other two need"
            )
        return low, high

    @cached_property
    def _lowest(self) -> float:
        """The least of what is sliced."""
        if self.sliced == "peak-jerk":
            return least_jerk_cap(self.alone.truss.stroke, self.alone.truss.duration[1])
        return self._value_of_the_least(self.sliced)

    @property
    def _highest(self) -> float | None:
        """The most that the study allows of what is sliced; None where it allows all."""
        truss = self.alone.truss
        if self.sliced == "time":
            return truss.duration[1]
        return cap_on(truss.caps, truss.drive, self.sliced)

    def _value_of_the_least(self, name: str) -> float:
        """What is sliced, of the motion with the least of an objective."""
        self.console.progress(f"an end of the surface: the least {QUANTITIES[name].title}")
        truss = self.alone.minimising(name)
        try:
            law = Search(truss, self.console).run().deployment.law
        except StudyError as error:
            if error.exit_code is ExitCode.INTERRUPTED:
                raise KeyboardInterrupt from error
            raise
        values = Deployment("end", law, truss.truss, truss.drive, truss.margin).values
        return values[self.sliced]

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
        subject = self._subject(limit)
        name = f"{self.quantity.title} {limit:.5g} {self.quantity.unit}"
        self.console.progress(f"slice {len(self.tried)} of {self.wanted}: {name}")
        try:
            found = subject.walk(self._neighbours(limit), self.count)
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
        return self.begin + self.study.truss.solver.seconds

    @cached_property
    def _constant(self) -> Constant:
        """Stands for the limit of each slice in the program that they share."""
        return Constant("limit of the slice", self.quantity.unit, max(self.tried))

    def _subject(self, limit: float) -> SliceFront:
        origin = self.slices[-1].subject if self.slices else None
        while origin is not None and origin.origin is not None:
            origin = origin.origin
        return SliceFront(self.study, limit, self._constant, self.console, self._until, origin)

    def _neighbours(self, limit: float) -> list[Slice]:
        """The slices next to a limit, the one with the higher limit first."""
        above = [one for one in self.slices if one.limit > limit][:1]
        below = [one for one in self.slices if one.limit < limit][-1:]
        return [*above, *below]

    def _told(self, points: int) -> None:
        """Say what a slice gave, and what is left to do."""
        left, spent = self.wanted - len(self.tried), clock.monotonic() - self.begin
        about = in_words(spent / len(self.tried) * left)
        rest = f"{left} left, about {about}" if left else "it was the last one"
        self.console.progress(f"slice {len(self.tried)}: {points} points; {rest}")


def in_words(seconds: float) -> str:
    """A time as one says it."""
    return f"{seconds:.0f} s" if seconds < 100.0 else f"{seconds / 60:.0f} min"
