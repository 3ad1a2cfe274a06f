"""Fronts of the arm: what is refused, and a short front, its slopes held against differences."""

from types import SimpleNamespace

import numpy as np
import pytest

from ocp import FrontPoint, ParetoFront, PointNotFound
from studies.arm import draw
from studies.arm.config import as_dictionary
from studies.arm.optimal.rounds import MISS
from studies.arm.optimal.solve import solve_again, solve_stage
from studies.arm.questions.fronts import study as study_module
from studies.arm.questions.fronts.laws import TimedLaw
from studies.arm.questions.fronts.nearby_solves import NearbySolves, NotStillError, SoughtPoint
from studies.arm.questions.fronts.point import AXES, Demand, most_left, unit_of
from studies.arm.questions.fronts.study import laws_beside, result_of, walked_front
from studies.arm.questions.fronts.subject import ArmFront
from studies.arm.stage import big_arm
from studies.arm.trade_off import TradeOffStudy
from studies.common.configuration import from_mapping
from studies.common.console import silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.export.source import with_motion

SHORT = {"objectives": "peak-torque,time", "range": "8.6..8.7"}
LEFT = {"objectives": "peak-torque,residual-energy"}


def test_the_one_that_is_easy_to_limit_is_limited_and_a_study_is_made_again():
    study = from_mapping(TradeOffStudy, SHORT)
    assert (study.limited, study.least) == ("time", "peak-torque")
    assert study.range == (8.6, 8.7)
    again = from_mapping(TradeOffStudy, as_dictionary(study))
    assert as_dictionary(again) == as_dictionary(study)
    assert from_mapping(TradeOffStudy, {"objectives": ["deflection", "peak-torque"]}).limited == (
        "peak-torque"
    )


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        ({"objectives": "time"}, "give two out of time, residual-energy"),
        (
            {"objectives": "deflection,time,peak-torque"},
            "sweep over limits on it: antenna-ocp sweep with the subject",
        ),
        ({"objectives": "time,residual-energy"}, "sweep the duration of antenna-ocp arm solve"),
        ({"objectives": "time,time"}, "names time twice"),
        ({"objectives": "time,torque"}, "objectives is 'torque'; "),
        (LEFT | {"range": "1e-9..1"}, "up to residual_energy, 1e-06 J, the arm counts as at rest"),
        (SHORT | {"range": "9..8"}, "give the lower limit first"),
        (SHORT | {"range": "9"}, "give LOW..HIGH"),
        (SHORT | {"points": 2}, "points is 2; give a whole number of at least 3"),
        (SHORT | {"stage": "both"}, "give big or small"),
    ],
)
def test_what_is_refused(raw, words):
    with pytest.raises(StudyError) as caught:
        from_mapping(TradeOffStudy, raw)
    assert words in str(caught.value)


def test_an_end_that_no_motion_reaches_is_said_with_its_remedy(monkeypatch):
    subject = ArmFront(from_mapping(TradeOffStudy, SHORT), silent())

    def none(*given):
        raise PointNotFound("2 J are left")

    monkeypatch.setattr(subject, "_refined", none)
    with pytest.raises(StudyError, match=r"upper end of the front, .* 8\.7 s: 2 J are left; give"):
        list(subject.ends())


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
        list(ArmFront(from_mapping(TradeOffStudy, raw), silent()).ends())
    assert words in str(caught.value)
    assert caught.value.exit_code == ExitCode.INFEASIBLE


@pytest.mark.parametrize(
    ("objectives", "order"),
    [
        (LEFT["objectives"], ("residual-energy", "peak-torque")),
        ("deflection,residual-energy", ("residual-energy", "deflection")),
    ],
)
def test_the_last_of_the_order_is_least(objectives, order):
    study = from_mapping(TradeOffStudy, {"objectives": objectives})
    assert study.objectives == order
    assert (study.limited, study.least) == order


def test_limits_become_what_a_motion_has_to_keep():
    stage = big_arm(8.6)
    demand = Demand.of(stage, {"time": 9.0, "residual-energy": 1e-3})
    assert (demand.stage.duration, demand.left, demand.caps.torque) == (9.0, 1e-3, (None, None))
    [bound] = demand.stated("peak-torque").arm.bounds
    assert bound.name == "energy left by big"
    still = Demand.of(stage, {"peak-torque": 3.5})
    assert (still.left, still.caps.torque) == (None, (3.5, 3.5))
    assert still.stated("deflection").arm.bounds == ()


def test_the_energy_looked_at_is_a_part_of_that_of_the_mean_rate():
    stage = big_arm(8.6)
    rate = (stage.end[0] - stage.start[0]) / 8.6
    assert most_left(stage) == pytest.approx(0.1 * 0.5 * stage.inertias[0] * rate**2)
    assert most_left(stage.lasting(17.2)) == pytest.approx(most_left(stage) / 4)


@pytest.mark.parametrize(("missed", "found"), [(0.0, True), (2e-4, True), (2e-3, False)])
def test_the_reduced_model_is_asked_for_less_where_the_full_one_has_more(
    monkeypatch, missed, found
):
    """Amplitudes add up: of 1e-3, the root of a limit of 1e-6 J, a fifth may be taken off."""
    solved = []

    def again(self, sought):
        solved.append(sought.demand.left)
        left = (sought.demand.left**0.5 + missed) ** 2
        replayed = SimpleNamespace(residual_energy=left, miss=0.0)
        return SimpleNamespace(replay=lambda settings: replayed)

    monkeypatch.setattr(NearbySolves, "_again", again)
    subject = ArmFront(from_mapping(TradeOffStudy, LEFT), silent())
    demand = Demand.of(big_arm(8.6), {"residual-energy": 1e-6})
    asked = SoughtPoint(None, demand, "peak-torque", 1e-6, None)
    if not found:
        with pytest.raises(PointNotFound, match="the residual energy on the full model is 8"):
            subject.nearby.once(asked)
        return
    tried = subject.nearby.once(asked)
    assert tried.replay.residual_energy == pytest.approx(0.98e-6)
    assert len(solved) == (1 if missed == 0.0 else 2)
    assert tried.asked == solved[-1]


def test_a_motion_that_does_not_rest_is_sought_with_more_smoothness(monkeypatch):
    weights = []

    def once(self, sought):
        weights.append(sought.weight)
        if len(weights) == 1:
            raise NotStillError("7e-06 J are left")
        return "calm"

    monkeypatch.setattr(NearbySolves, "once", once)
    monkeypatch.setattr(ArmFront, "_kept", lambda self, found, limits: found)
    subject = ArmFront(from_mapping(TradeOffStudy, LEFT), silent())
    start = SimpleNamespace(weight=1e-6, intervals=150)
    assert subject._solved({"peak-torque": 3.4}, "deflection", start, None) == "calm"
    assert weights == pytest.approx([1e-6, 1e-5])


def alike(subject):
    """Two ends of a front whose values differ by less than a point is known to."""
    return [point_at(subject, limit, y) for limit, y in ((8.7, 3.28), (8.6, 3.30))]


def point_at(subject, limit, y):
    values = {"time": limit, "residual-energy": 1e-7, "peak-torque": y, "deflection": 1e-3}
    motion = SimpleNamespace(smoothness_share=0.0, weight=1e-6)
    replay = SimpleNamespace(residual_energy=1e-7, miss=1e-6)
    kept = SimpleNamespace(motion=motion, values=values, replay=replay)
    return FrontPoint(limit, limit, y, -0.2, "up", False, 1.0, kept)


def test_ends_that_are_alike_leave_nothing_to_trade_and_a_figure_shows_it(monkeypatch):
    monkeypatch.setattr(ArmFront, "ends", alike)
    for name in ("motion_series", "motion_details"):
        monkeypatch.setattr(study_module, name, lambda points: {})
    subject = ArmFront(from_mapping(TradeOffStudy, SHORT), silent())
    walked = walked_front(subject)
    assert len(walked.points) == 2

    laws = [TimedLaw("Step5", point_at(subject, 8.6, 9.0).motion.values)]
    monkeypatch.setattr(study_module, "places_of", lambda laws, keys, still: {})
    result = result_of(subject, walked, laws)
    assert result.passed
    assert result.remarks[0] == (
        "There is no trade-off: peak torque is 3.3 N m at 8.6 s of duration and 3.28 N m at 8.7 s, "
        "and the accuracy of a point is 1 %."
    )
    [(_, figure)] = draw(result)
    low, high = figure.axes[0].get_ylim()
    # 0.6 % of difference is drawn as little of the height
    assert 0.2 * (high - low) > 3.3 - 3.28


@pytest.fixture(scope="module")
def short_front():
    subject = ArmFront(from_mapping(TradeOffStudy, SHORT), silent())
    right, left = subject.ends()
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
        point.motion.motion.objective * unit_of(point.motion.motion) for point in (left, right)
    ]
    difference = (torque[1] - torque[0]) / (right.x - left.x)
    assert 0.5 * (left.slope + right.slope) == pytest.approx(difference, rel=0.02)


def test_after_a_stop_the_laws_are_replayed_in_one_duration(monkeypatch):
    monkeypatch.setattr(
        "studies.arm.questions.fronts.study.laws_in", lambda stage, durations, console: durations
    )
    study = from_mapping(TradeOffStudy, SHORT)
    assert study.limited == "time"
    found = ParetoFront(tuple(point_at(None, limit, 3.0) for limit in (7.0, 9.0)))
    whole, short = (laws_beside(study, found, silent(), whole) for whole in (True, False))
    assert len(whole) > 2
    assert short == [8.0]


@pytest.mark.slow
def test_its_result_has_laws_words_and_a_figure(short_front):
    subject, *points = short_front
    values = points[0].motion.values | {"peak-torque": 9.0, "residual-energy": 1e-5}
    laws = [TimedLaw(name, values) for name in ("Step5", "Bezier")]
    result = result_of(subject, ParetoFront(tuple(points)), laws)
    assert result.kind == "pareto-arm"
    assert result.verdict.kind == "local"
    assert np.all(result.arrays["peak-torque"].values > result.arrays["bound"].values)
    assert any("Its residual energy is 1e-05 J" in remark for remark in result.remarks)
    [(name, figure)] = draw(result)
    assert name == "front"
    assert figure.axes[1].get_xlabel() == f"{AXES['time'].title} [s]"

    # each point's motion is kept, and goes out as that of `arm solve` does
    second = with_motion(result, "point 2")
    assert second.axis == "time"
    assert second.arrays["root_angle"].values[-1] == pytest.approx(np.pi / 2, abs=MISS)
    assert second.arrays["root_torque"].values.max() == pytest.approx(points[1].y, rel=2e-3)


@pytest.mark.slow
def test_a_lock_that_may_meet_a_swing_needs_less_torque():
    study = from_mapping(TradeOffStudy, LEFT | {"range": "1e-4..1.1e-4"})
    subject = ArmFront(study, silent())
    # as of a neighbour: the refinement before it takes most of the time
    stage = study.slew
    rest = solve_stage(stage, objective="peak-torque")
    none = np.zeros(2 * stage.model.size)
    start = solve_again(rest, weight=1e-6, aim=none)
    at = [subject._solved({"residual-energy": E}, "peak-torque", start, none) for E in (1e-4, 1e-2)]
    for point, limit in zip(at, (1e-4, 1e-2), strict=True):
        # the full model swings as the reduced one does, which is asked for 2 % less
        assert point.values["residual-energy"] == pytest.approx(0.98 * limit, rel=0.01)
    light, heavy = (point.values["peak-torque"] for point in at)
    # a rigid arm that may turn on with the energy E: 4 J D/T^2 falls by about a root of E
    assert heavy == pytest.approx(3.1113, rel=3e-3)
    assert light == pytest.approx(3.2963, rel=3e-3)

    beside = [
        subject._solved({"residual-energy": E}, "peak-torque", at[1].motion, none).motion
        for E in (0.98e-2, 1.02e-2)
    ]
    torque = [motion.objective * unit_of(motion) for motion in beside]
    difference = (torque[1] - torque[0]) / 0.04e-2
    assert at[1].slopes["residual-energy"] == pytest.approx(difference, rel=0.02)
