"""Ctrl-C before a front is walked: the work ends, and what was found is kept."""

from types import SimpleNamespace

import numpy as np
import pytest

from ocp import FrontPoint
from studies.common.console import silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.fronts.columns import FrontAxis, front_details, front_series
from studies.fronts.found import front_found
from studies.fronts.words import front_in_words
from studies.truss.search import best_law as searches

POINT = FrontPoint(2.0, 2.0, 0.5, -0.25, "up", False, 1.0, None)


class StoppedFront:
    """A front whose user stops it after a number of its ends."""

    console = silent()

    def __init__(self, points):
        self.points = points

    def ends(self):
        yield from [POINT] * self.points
        raise KeyboardInterrupt


@pytest.mark.parametrize("raised", [False, True])
def test_a_search_that_the_user_stopped_gives_no_end_of_a_front(raised, monkeypatch):
    """Whether the search has a motion by then, or raises for want of one."""

    def stopped(*_, **__):
        if raised:
            raise StudyError("interrupted", ExitCode.INTERRUPTED)
        return SimpleNamespace(interrupted=True, deployment=None)

    monkeypatch.setattr(searches, "best_motion", stopped)
    with pytest.raises(KeyboardInterrupt):
        searches.best_law(None, silent())


def test_a_front_that_is_stopped_before_its_first_point_has_the_code_of_that():
    with pytest.raises(StudyError, match="stopped before a point of the front") as raised:
        front_found(StoppedFront(0), 9, coarse=False)
    assert raised.value.exit_code is ExitCode.INTERRUPTED


def test_the_first_point_of_a_front_that_is_stopped_is_kept():
    walked = front_found(StoppedFront(1), 9, coarse=False)
    assert walked.interrupted
    assert walked.points == (POINT,)
    # one point has columns and words, as a front has
    axes = FrontAxis("time", "duration", "s"), FrontAxis("peak-force", "peak rope force", "N")
    assert front_series(walked, np.array([0.4]), *axes)["time"].values.tolist() == [2.0]
    assert front_details(walked, *axes)
    assert "one verified point" in " ".join(front_in_words(walked, *axes))
