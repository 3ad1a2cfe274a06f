"""A front from its two ends: what is kept where the user stops, and what is said without an end."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from ocp import FrontPoint, FrontSubject, ParetoFront, PointNotFound, front_between
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.fronts.columns import FrontAxis
from studies.fronts.keys import COARSE_POINTS
from studies.fronts.words import nothing_to_trade


class MechanismFront(FrontSubject, Protocol):
    """The motions of a mechanism as points of a front."""

    console: Console

    @property
    def axes(self) -> tuple[FrontAxis, FrontAxis]:
        """The objective that is limited, and the one that is least under each limit."""
        ...

    @property
    def known(self) -> float:
        """Part of a value by which a point may be wrong: ends that differ by less are alike."""
        ...

    def ends(self) -> Iterator[FrontPoint]:
        """The points at the lowest and at the highest limit, in any order, as they are found.

        Raises `PointNotFound` or `StudyError` where one has no motion.
        """
        ...


def front_found(subject: MechanismFront, points: int, *, coarse: bool) -> ParetoFront:
    """The front between both ends; the ends alone where nothing is traded between them.

    Raises
    ------
    StudyError
        If an end of the front has no motion, or the user stopped before there was a point.
    """
    found: list[FrontPoint] = []
    try:
        for end in subject.ends():
            found.append(end)  # at once, so that nothing is lost where the user stops
    except PointNotFound as error:
        raise StudyError(
            f"no motion was found at an end of the front: {error}; give a smaller range",
            ExitCode.NOT_SOLVED,
        ) from error
    except KeyboardInterrupt as stop:
        if not found:
            raise StudyError(
                "stopped before a point of the front was found; the inputs are kept",
                ExitCode.INTERRUPTED,
            ) from stop
        return ParetoFront((found[0],), interrupted=True)

    left, right = sorted(found, key=lambda point: point.limit)
    alike = nothing_to_trade(left, right, subject.axes, subject.known)
    if alike is not None:
        return ParetoFront((left, right), remarks=(alike,))
    count = min(points, COARSE_POINTS) if coarse else points
    return front_between(subject, left, right, count, subject.console.progress)
