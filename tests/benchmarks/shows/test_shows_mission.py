"""The show of missions: what moved time makes of a split, and how it is judged."""

from types import SimpleNamespace

import pytest

from benchmarks.shows.scale import mission
from studies.mission.config import MissionStudy
from studies.mission.stages import STAGES

# stages of a rigid body: each uses its size over the square of its time
SIZES = dict(zip(STAGES, (1.0, 4.0, 9.0), strict=True))


@pytest.fixture
def rigid(monkeypatch):
    def move(study, name, duration, console):
        return SimpleNamespace(utilisation=SIZES[name] / duration**2)

    monkeypatch.setattr(mission, "move", move)


def moved(durations):
    times = dict(zip(STAGES, durations, strict=True))
    used = {name: SIZES[name] / times[name] ** 2 for name in STAGES}
    return mission.moved_time(MissionStudy(), times, used)


def row(durations, passed=True):
    return {"passed": passed, "moved": moved(durations)}


def test_moving_time_from_stages_that_use_their_caps_alike_loses(rigid):
    found = moved((1.0, 2.0, 3.0))
    # 1 % of six seconds less for the ring is 2 % of its own time
    assert found["ring to big arm"] == pytest.approx(0.98**-2, rel=1e-12)
    assert len(found) == 6
    assert min(found.values()) > 1.0
    assert mission._verdict(row((1.0, 2.0, 3.0))) == "moving time loses"


def test_a_split_that_moved_time_makes_better_is_called_so(rigid):
    found = moved((1.0, 2.5, 2.5))
    assert found["small arm to ring"] < 1.0
    assert mission._verdict(row((1.0, 2.5, 2.5))) == "BETTER"
    assert mission._verdict(row((1.0, 2.0, 3.0), passed=False)) == "CHECKS FAILED"


def test_a_stage_that_more_time_helps_no_further_has_nothing_to_gain():
    assert mission._verdict({"passed": True, "moved": {"a": 0.9999}}) == "moving time gains nothing"
