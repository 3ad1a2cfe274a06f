"""Fronts of the arm: what is refused, and a short front, its slopes held against differences."""

from types import SimpleNamespace

import numpy as np
import pytest
from studies.arm.questions.front import AXES, ArmFront, Law, result_of

from studies.arm import draw
from studies.arm.config import TradeOffStudy, as_dictionary, question_from
from studies.arm.optimal.rounds import MISS
from studies.common.console import silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.pareto.both_ways import Walked
from studies.pareto.continuation import NotFoundError, Ranges
from studies.pareto.envelope import front_of

SHORT = {"objectives": "peak-torque,time", "range": "8.6..8.7"}


def test_the_one_that_is_easy_to_limit_is_limited_and_a_study_is_made_again():
    study = question_from(TradeOffStudy, SHORT)
    assert (study.limited, study.least) == ("time", "peak-torque")
    assert study.range == (8.6, 8.7)
    again = question_from(TradeOffStudy, as_dictionary(study))
    assert as_dictionary(again) == as_dictionary(study)
    assert question_from(TradeOffStudy, {"objectives": ["deflection", "peak-torque"]}).limited == (
        "peak-torque"
    )


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        ({"objectives": "time"}, "give two out of time, peak-torque"),
        ({"objectives": "time,time"}, "names time twice"),
        ({"objectives": "time,torque"}, "objectives is 'torque'; "),
        ({"objectives": "peak-torque,residual-energy"}, "give residual-energy beside time"),
        ({"points": 9}, "points is stated, but where residual-energy"),
        ({"range": "8..9"}, "range is stated, but where residual-energy"),
        (SHORT | {"range": "9..8"}, "give the lower limit first"),
        (SHORT | {"range": "9"}, "give LOW..HIGH"),
        (SHORT | {"points": 2}, "points is 2; give a whole number of at least 3"),
        (SHORT | {"stage": "both"}, "give big or small"),
    ],
)
def test_what_is_refused(raw, words):
    with pytest.raises(StudyError) as caught:
        question_from(TradeOffStudy, raw)
    assert words in str(caught.value)


def test_an_end_that_no_motion_reaches_is_said_with_its_remedy(monkeypatch):
    subject = ArmFront(question_from(TradeOffStudy, SHORT), silent())

    def none(*given):
        raise NotFoundError("2 J are left")

    monkeypatch.setattr(subject, "_refined", none)
    with pytest.raises(StudyError, match=r"between 8\.6 and 8\.7 s: 2 J are left; state another"):
        subject.ends()


@pytest.mark.parametrize(
    ("objectives", "limits", "words"),
    [
        ("time,peak-torque", "0.5..1", "would bend a link by about 0.31 rad"),
        ("peak-torque,deflection", "3..4", "even a rigid arm takes more than 8.97"),
    ],
)
def test_limits_that_nothing_meets_are_refused_at_once(objectives, limits, words):
    raw = {"objectives": objectives, "range": limits}
    with pytest.raises(StudyError) as caught:
        ArmFront(question_from(TradeOffStudy, raw), silent()).ends()
    assert words in str(caught.value)
    assert caught.value.exit_code == ExitCode.INFEASIBLE


def test_ends_that_are_alike_leave_nothing_to_trade(monkeypatch):
    subject = ArmFront(question_from(TradeOffStudy, SHORT), silent())
    ends, motion = {8.6: 3.30, 8.7: 3.28}, SimpleNamespace(motion=SimpleNamespace(weight=1e-6))
    monkeypatch.setattr(subject, "_end", lambda at, way: SimpleNamespace(y=ends[at], motion=motion))
    with pytest.raises(StudyError, match=r"nothing to trade: peak torque is 3\.3 N m at 8\.6 s"):
        subject.ends()


@pytest.fixture(scope="module")
def short_front():
    subject = ArmFront(question_from(TradeOffStudy, SHORT), silent())
    left, right = subject.ends()
    return subject, left, subject.near(8.65, left, "up"), right


@pytest.mark.slow
def test_points_are_still_and_their_slopes_are_those_of_differences(short_front):
    subject, *points = short_front
    left, _, right = points
    # 1.9 % above the rigid arm's 3.264 N m, 0.5 % more than the end's motion before it is coarsened
    assert left.y == pytest.approx(3.326, rel=3e-3)
    for point in points:
        assert point.motion.replay.residual_energy <= subject.residual
        assert point.motion.replay.miss <= MISS

    # of the motions as they were solved, without the torque that full models need besides
    torque = [
        point.motion.motion.objective * subject.unit_of(point.motion.motion)
        for point in (left, right)
    ]
    difference = (torque[1] - torque[0]) / (right.x - left.x)
    assert 0.5 * (left.slope + right.slope) == pytest.approx(difference, rel=0.02)


@pytest.mark.slow
def test_its_result_has_laws_words_and_a_figure(short_front):
    subject, *points = short_front
    ranges = Ranges((points[0].x, points[-1].x), (points[-1].y, points[0].y))
    walked = Walked(front_of(points, ranges, 2.0), (), stopped=False)
    laws = [Law(name, 8.6, (8.6, 9.0), 1e-5) for name in ("Step5", "Bezier")]
    result = result_of(subject, walked, laws)
    assert result.kind == "pareto-arm"
    assert result.verdict.kind == "local"
    assert np.all(result.arrays["peak-torque"].values > result.arrays["bound"].values)
    assert any("It leaves 1e-05 J" in remark for remark in result.remarks)
    [(name, figure)] = draw(result)
    assert name == "front"
    assert figure.axes[1].get_xlabel() == f"{AXES['time'].title} [s]"
