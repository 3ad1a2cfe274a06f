"""Three quantities of the arm: slices, each a front of two of them under a limit on the third."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ocp.analysis.front.both_ways import Walked, both_ways, walked_down
from ocp.analysis.front.continuation import FrontPoint, Ranges
from ocp.analysis.front.envelope import front_of
from studies.arm.optimal.rounds import SAME
from studies.arm.optimal.solve import check_bending
from studies.arm.questions.fronts.point import AXES, most_left
from studies.arm.questions.fronts.subject import ArmFront
from studies.arm.search_limits import FRONT_DURATIONS, FRONT_SECONDS, SLICE_SECONDS
from studies.arm.trade_off import TradeOffStudy
from studies.common.console import Console
from studies.pareto.surface.shape import SurfacePoint
from studies.pareto.surface.walk import Slice, SliceRequest
from studies.pareto.words import nothing_to_trade


class ArmSlice(ArmFront):
    """A slice's motions as points of a front; a `walk.SliceSubject`.

    Parameters
    ----------
    level : the limit of the slice.
    """

    def __init__(self, study: TradeOffStudy, console: Console, level: float, until: float) -> None:
        assert study.sliced is not None
        super().__init__(study, console, {study.sliced: level}, until)
        self.sliced = study.sliced

    @property
    def level(self) -> float:
        """The limit of the slice."""
        return self.levels[self.sliced]

    def on_surface(self, point: FrontPoint) -> SurfacePoint:
        """A point of the slice with its third quantity, and the price of the slice's limit.

        A motion that keeps the limit counts as one that has it: what it has less differs from
        point to point by chance, and would make each of them the best in something.
        """
        z = max(self.level, point.motion.values[self.sliced])
        return SurfacePoint(self.level, z, point.motion.slopes[self.sliced], point)

    def bound(self, x: float) -> float | None:
        """None: nothing is proven of an arm whose links bend."""
        del x
        return None

    def walk(self, neighbours: Sequence[Slice], count: int) -> Slice:
        """The slice, from the ends of its neighbours or, without any, from refined motions.

        Raises
        ------
        NotFoundError, StudyError
            If it has no motion.
        """
        subjects = [one.subject for one in neighbours if isinstance(one.subject, ArmSlice)]
        left, right = self.ends(
            [one.left.motion for one in neighbours],
            [one.right.motion for one in neighbours],
            [subject.bests for subject in subjects],
        )
        alike = nothing_to_trade(left, right, (AXES[self.limited], AXES[self.least]), SAME)
        if alike is not None:
            walked = ends_alone(
                left, right, f"{alike[0].lower()}{alike[1:-1]}"
            )  # the rest of a sentence
        elif self.study.coarse:
            walked = walked_down(self, right, left.limit, left.y, count)
        else:
            walked = both_ways(self, left, right, count, self.console.live)
        remarks = (*self.remarks, *walked.remarks)
        return Slice(self, left, right, replace(walked, remarks=remarks))


def ends_alone(left: FrontPoint, right: FrontPoint, why: str) -> Walked:
    """A front of its two ends, between which nothing is traded."""
    heights = min(left.y, right.y), max(left.y, right.y)
    front = front_of([left, right], Ranges((left.x, right.x), heights), widest=9.0)
    return Walked(front, (why,), stopped=False)


class ArmSurface:
    """A study of three quantities of the arm; a `walk.Sliced`."""

    def __init__(self, study: TradeOffStudy, console: Console) -> None:
        assert study.sliced is not None
        self.study, self.console = study, console
        self.request = SliceRequest.of(
            AXES[study.sliced],
            study.slices,
            study.points,
            coarse=study.coarse,
            seconds=study.seconds or FRONT_SECONDS,
            each=SLICE_SECONDS,
        )

    def ends(self) -> tuple[float, float]:
        """Lowest and highest limit of the slices: what one would look at first."""
        stage = self.study.slew
        if self.study.sliced == "time":
            shortest, longest = FRONT_DURATIONS
            return shortest * stage.duration, longest * stage.duration
        return self.study.still, most_left(stage)

    def check(self) -> None:
        """Refuse a slice so short that it bends the links too far.

        Raises
        ------
        StudyError
            With the duration that would do.
        """
        stage = self.study.slew
        if self.study.sliced == "time":
            stage = stage.lasting((self.request.stated or self.ends())[0])
        check_bending(stage)

    def walk(self, limit: float, neighbours: Sequence[Slice], until: float) -> Slice:
        """A slice, see `walk.Sliced`."""
        subject = ArmSlice(self.study, self.console, limit, until)
        return subject.walk(neighbours, self.request.count)
