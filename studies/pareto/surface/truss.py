"""A surface of the truss: where its slices lie, and what is refused before the first one."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from models.laws import least_jerk_cap
from ocp import Constant
from studies.common.console import Console
from studies.common.exit_codes import StudyError
from studies.pareto.columns import FrontAxis
from studies.pareto.config import ParetoStudy
from studies.pareto.surface.slices import SliceFront
from studies.pareto.surface.walk import ABOVE, Slice, SliceRequest
from studies.pareto.truss import TrussFront, limited
from studies.truss.limits.caps import cap_on
from studies.truss.motions.deployment import Deployment
from studies.truss.quantities import OBJECTIVES, QUANTITIES
from studies.truss.search.best_law import best_law
from studies.truss.search.motion_search import Search

SECONDS = 45.0, 15.0  # that a slice takes, and one of a sketch


class TrussSurface:
    """A study of three objectives of the truss; a `walk.Sliced`."""

    def __init__(self, study: ParetoStudy, console: Console) -> None:
        pareto = study.pareto
        assert pareto.sliced is not None
        self.study, self.console, self.sliced = study, console, pareto.sliced
        self.quantity = QUANTITIES[pareto.sliced]
        self.alone = TrussFront(study, console)  # without a limit on what is sliced
        self.request = SliceRequest.of(
            FrontAxis(pareto.sliced, self.quantity.title, self.quantity.unit),
            pareto.slices,
            pareto.points,
            coarse=pareto.coarse,
            seconds=study.truss.solver.seconds,
            each=SECONDS,
        )
        self.origin: SliceFront | None = None  # that states the program of all slices

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
        if self.sliced == "peak-jerk" and self._highest is None and not self.request.stated:
            raise StudyError(
                "slices of the jerk need its highest value; state a jerk cap, as --jerk-cap 500/T^3"
                ", or the limits: --slices LOW,...,HIGH"
            )
        for limit in self.request.stated:
            Search(limited(self.alone.truss, self.sliced, limit), self.console).check()

    def walk(self, limit: float, neighbours: Sequence[Slice], until: float) -> Slice:
        """A slice, see `walk.Sliced`; the first one, which allows most, states the program."""
        if self.origin is None:
            constant = Constant("limit of the slice", self.quantity.unit, limit)
        else:
            constant = self.origin.constant
        subject = SliceFront(self.study, limit, constant, self.console, until, self.origin)
        self.origin = self.origin or subject
        return subject.walk(neighbours, self.request.count)

    def ends(self) -> tuple[float, float]:
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
        law = best_law(truss, self.console)
        values = Deployment("end", law, truss.truss, truss.drive, truss.margin).values
        return values[self.sliced]
