"""Motions that are not all of the opening: from any angle and rate to any angle."""

import itertools
import math
import re

import numpy as np
import pytest
from scipy.integrate import quad

from models.laws import Step5, UnderWay, least_peak_acceleration
from models.truss import (
    DYNAMIC_SET,
    Opening,
    TrussParameters,
    kinetic_energy,
    potential,
    rope_speed,
    rope_taken,
    rope_travel,
    static_force,
    static_peak,
)
from studies.codesign import study_from as codesign_from
from studies.common.console import silent
from studies.common.exit_codes import StudyError
from studies.common.result import Result
from studies.drive.course import rope_course, with_dwells
from studies.drive.playback import played
from studies.drive.schema import Drive
from studies.drive.setpoints import sampled, uniform_times
from studies.truss.config import TrussStudy, as_dictionary, study_from
from studies.truss.limits.bounds import lower_bounds
from studies.truss.limits.feasibility import check_feasible
from studies.truss.motions.laws import (
    deployment_of,
    law_of_result,
    laws_from_rest,
    paper_laws_of,
)
from studies.truss.motions.phase_plane import PhasePlane
from studies.truss.rope import rope_of
from studies.truss.study import run

SMOOTH = TrussParameters(joint_friction=0.0, slider_friction=0.0)  # energy is kept


def stated(**keys: object) -> TrussStudy:
    return study_from({"minimise": "peak-acceleration", "duration": 70.0, **keys})


def values(result: Result, key: str) -> float:
    (row,) = (row for row in result.table if row.key == key)
    return row.values["optimal"]


def test_the_whole_opening_may_be_stated_as_well() -> None:
    caps = {"jerk": "bezier"}
    default = stated(caps=caps)
    whole = stated(caps=caps, start_deg=4.4, start_rate_deg_per_s=0.0, end_deg=90.0)

    assert whole.opening == default.opening == Opening(DYNAMIC_SET.stowed_angle)
    assert whole.question == default.question
    first, second = (run(study, silent()) for study in (default, whole))
    assert [row.values for row in first.table] == [row.values for row in second.table]
    assert "start_deg" not in first.configuration


def test_a_study_states_itself_again() -> None:
    study = stated(start_deg=45.0, start_rate_deg_per_s=1.5, end_deg=80.0)

    assert study_from(as_dictionary(study)).opening == study.opening
    assert study.opening.start == pytest.approx(math.pi / 4)
    assert "from 45 deg at 1.5 deg/s to 80 deg" in study.question


def test_half_open_at_rest_takes_the_least_time_of_the_closed_form() -> None:
    result = run(
        stated(
            minimise="time",
            duration=[1.0, 100.0],
            start_deg=45.0,
            caps={"speed": 0.05, "acceleration": 0.01},
        ),
        silent(),
    )

    assert result.verdict.kind == "global"
    assert values(result, "time") == pytest.approx(math.pi / 4 / 0.05 + 0.05 / 0.01, rel=1e-7)
    assert all(check.passed for check in result.checks)


def test_a_tip_off_brakes_and_goes_on() -> None:
    """2 deg/s at the stowed angle: the least acceleration without a jerk cap is two arcs of it."""
    study = stated(duration=70.0, start_rate_deg_per_s=2.0)
    result = run(study, silent())
    law = law_of_result(result)

    # with A up to the middle speed v and down again: v - v0 + v = A T, and the way of both is D
    T, v0, mean = 70.0, math.radians(2.0), study.stroke / 70.0
    assert mean > v0 / 2  # else it would only brake
    least = (2 * mean - v0 + math.hypot(2 * mean - v0, v0)) / T
    assert values(result, "peak-acceleration") == pytest.approx(least, rel=1e-6)
    assert law.motion([0.0]).speed[0] == pytest.approx(v0, rel=1e-12)
    assert result.laws == ("optimal",)
    assert any("start at rest, so none of them is compared" in words for words in result.remarks)


@pytest.mark.parametrize(("start", "rate", "end"), [(45.0, 0.0, 90.0), (4.4, 20.0, 90.0)])
def test_the_fastest_motion_is_that_of_the_energies(start: float, rate: float, end: float) -> None:
    """Without friction work and energies give the speed at each angle, and so the time."""
    opening, F = Opening(*np.radians([start, end, rate])), 30.0
    begun = float(kinetic_energy(SMOOTH, opening.start, opening.rate))
    U = [float(potential(SMOOTH, angle)) for angle in (opening.start, opening.end)]

    def driven(angle: float) -> float:
        wound = rope_travel(SMOOTH, Opening(opening.start, angle)) if angle > opening.start else 0
        return begun + 2 * F * wound - float(potential(SMOOTH, angle)) + U[0]

    def slowness(angle: float) -> float:
        energy = min(driven(angle), U[1] - float(potential(SMOOTH, angle)))
        return math.sqrt(float(kinetic_energy(SMOOTH, angle, 1.0)) / energy)

    plane = PhasePlane(SMOOTH, opening=opening)
    motion = plane.fastest(F)
    assert motion is not None
    places = [motion.switch_angle, SMOOTH.net_angle]
    # rest at an end is a root of the speed: integrated over that root
    cells = np.unique([opening.start, *places, opening.end])
    middle = [
        quad(lambda s, a=a, b=b: 2 * s * slowness(a + s**2), 0.0, math.sqrt((b - a) / 2))[0]
        + quad(lambda s, a=a, b=b: 2 * s * slowness(b - s**2), 0.0, math.sqrt((b - a) / 2))[0]
        for a, b in itertools.pairwise(cells)
    ]
    assert motion.duration == pytest.approx(sum(middle), rel=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_no_motion_beats_the_bounds(seed: int) -> None:
    """Of a law under way whose ropes pull: every lower bound of its own study is below it."""
    rng = np.random.default_rng(seed)
    start, end = np.radians(np.sort(rng.uniform([5.0, 60.0], [50.0, 90.0])))
    T, rate = rng.uniform(20.0, 100.0), math.radians(rng.uniform(0.1, 3.0))
    fading = min(T, 1.5 * (end - start) / rate)
    law = UnderWay(Step5(T, start + rate * fading / 3, end), rate, fading)
    study = stated(
        minimise="peak-force",
        duration=T,
        start_deg=math.degrees(start),
        start_rate_deg_per_s=math.degrees(rate),
        end_deg=math.degrees(end),
        caps={"jerk": 1.0},
        truss={"pulley_friction": 0.01},
    )
    law_values = deployment_of("law", law, study).values

    bounds = lower_bounds(study, PhasePlane(study.truss, opening=study.opening).least_force(T))
    assert law_values["least-tension"] >= 0.0
    assert {"peak-jerk", "peak-reaction", "energy", "peak-force"} <= bounds.keys()
    assert {
        key: law_values[key] - bounds[key] for key in bounds if law_values[key] < bounds[key]
    } == {}


def test_energies_count_what_the_ring_has_at_the_start() -> None:
    study = stated(start_rate_deg_per_s=2.0, caps={"jerk": "bezier"})
    deployment = deployment_of("law", law_of_result(run(study, silent())), study)
    energies = deployment.energies
    begun = float(kinetic_energy(study.truss, study.opening.start, study.opening.rate))

    assert energies.kinetic[-1] == pytest.approx(-begun, rel=1e-9)
    assert energies.imbalance < 1e-9


def test_margins_and_stalls_are_those_of_the_angles_that_are_passed() -> None:
    behind = Opening(math.radians(86.0))

    assert static_peak(DYNAMIC_SET, behind).force == pytest.approx(
        float(static_force(DYNAMIC_SET, behind.start)), rel=1e-9
    )
    assert static_peak(DYNAMIC_SET, behind).force < static_peak(DYNAMIC_SET).force


@pytest.mark.parametrize("ends", [{"start_deg": 85.0}, {"end_deg": 60.0, "start_deg": 45.0}])
def test_a_motion_on_one_side_of_the_net_has_one_phase(ends: dict[str, float]) -> None:
    result = run(stated(minimise="peak-force", caps={"jerk": "200/T^3"}, **ends), silent())

    assert all(check.passed for check in result.checks)
    assert result.bounds["peak-force"] <= values(result, "peak-force")


def test_laws_of_the_paper_fit_between_the_angles() -> None:
    bezier, step5 = paper_laws_of(stated(start_deg=45.0, end_deg=80.0), 70.0)

    for law in (bezier.law, step5.law):
        ends = law.motion([0.0, 70.0])
        assert np.degrees(ends.angle) == pytest.approx([45.0, 80.0])
        assert ends.speed == pytest.approx([0.0, 0.0], abs=1e-12)
    size = least_peak_acceleration(math.radians(35.0), 70.0)
    assert bezier.values["peak-acceleration"] == pytest.approx(5.617 / 4 * size, rel=1e-3)


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"start_deg": 3.0}, "start_deg is 3, but the stowed ring is at 4.4 deg"),
        ({"end_deg": 95.0}, "end_deg is 95, but the ring is open at 90 deg"),
        ({"start_deg": 50.0, "end_deg": 40.0}, "starts at 50 deg and ends at 40 deg; decrease"),
        (
            {"start_rate_deg_per_s": -1.0},
            "start_rate_deg_per_s is -1.0; give a finite non-negative",
        ),
    ],
)
def test_ends_that_no_motion_has_are_refused(keys: dict[str, float], sentence: str) -> None:
    with pytest.raises(StudyError, match=re.escape(sentence)):
        stated(**keys)


def test_ropes_that_only_pull_brake_a_start_so_far() -> None:
    study = stated(start_deg=80.0, start_rate_deg_per_s=300.0)
    plane = PhasePlane(study.truss, opening=study.opening)
    with pytest.raises(StudyError, match="ropes only pull") as refused:
        check_feasible(study, plane.least_force)

    (most,) = re.findall(r"at most ([0-9.]+)", str(refused.value))
    assert plane.fastest(1e3) is None
    opening = Opening(study.opening.start, rate=0.999 * math.radians(float(most)))
    assert PhasePlane(study.truss, opening=opening).fastest(1e3) is not None


def test_a_start_too_fast_to_brake_is_refused_with_the_number() -> None:
    fast = {"start_deg": 80.0, "start_rate_deg_per_s": 30.0}
    study = stated(**fast, caps={"acceleration": 0.5})
    with pytest.raises(
        StudyError, match=r"the caps on acceleration leave it too little to brake"
    ) as refused:
        check_feasible(study, PhasePlane(study.truss, opening=study.opening).least_force)

    (most,) = re.findall(r"at most ([0-9.]+)", str(refused.value))
    assert float(most) == pytest.approx(
        math.degrees(math.sqrt(2 * 0.5 * math.radians(10.0))), rel=1e-3
    )
    slower = stated(**fast | {"start_rate_deg_per_s": float(most)}, caps={"acceleration": 0.5})
    check_feasible(slower, PhasePlane(slower.truss, opening=slower.opening).least_force)


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        (
            {"start_rate_deg_per_s": 1.0, "arm": {}},
            "[arm], which is at rest at the start, is given",
        ),
        ({"end_deg": 80.0, "arm": {}}, "remove end_deg or [arm]"),
        (
            {"start_rate_deg_per_s": 1.0, "drive": {"rope_stiffness": 900.0}},
            "drive.rope_stiffness, for which the ring must be at rest at the start, is given",
        ),
        (
            {"start_rate_deg_per_s": 1.0, "drive": {"start_dwell": 1.0}},
            "drive.start_dwell is given; remove one of them",
        ),
    ],
)
def test_what_begins_at_rest_does_not_go_with_a_rate(
    keys: dict[str, object], sentence: str
) -> None:
    with pytest.raises(StudyError, match=re.escape(sentence)):
        stated(**keys)


def test_ropes_before_the_ridge_may_be_soft() -> None:
    """Behind the ridge the same ropes would snap through."""
    soft = {"drive": {"rope_stiffness": 10.0}}
    law = laws_from_rest(stated(end_deg=60.0, **soft), 70.0)[0]

    stability, modes, *_ = rope_of(law).sentences
    assert "of any stiffness the truss is stable" in stability
    assert "Hz at 60 deg" in modes
    with pytest.raises(StudyError, match="snaps through"):
        stated(start_deg=80.0, **soft)


def test_a_codesign_is_of_the_whole_opening() -> None:
    with pytest.raises(StudyError, match="a co-design includes the whole opening"):
        codesign_from({"minimise": "peak-force", "duration": 10.0, "start_deg": 45.0})


def test_gravity_along_the_axis_goes_with_an_arm() -> None:
    """Neither ring nor arm moves along it: the answer is that without weight."""
    weighed = {"truss": {"gravity": [0.0, 0.0, -9.81]}}
    law = laws_from_rest(stated(duration=10.0, arm={}), 10.0)[0]
    hung = laws_from_rest(stated(duration=10.0, arm={}, **weighed), 10.0)[0]

    assert hung.values == law.values


def test_a_drive_starts_where_the_rope_is() -> None:
    """Positions count from the stowed ring; under way the first velocity is that of the rope."""
    study = stated(start_deg=45.0, start_rate_deg_per_s=1.5)
    opening, truss = study.opening, study.truss
    law = UnderWay(
        Step5(20.0, opening.start + opening.rate * 5.0 / 3, opening.end), opening.rate, 5.0
    )
    course = rope_course(law, truss)
    points = sampled(course, uniform_times(course, 0.01))

    assert points.positions[0] == pytest.approx(float(rope_taken(truss, opening.start)))
    winding = -float(rope_speed(truss, opening.start, opening.rate))
    assert points.velocities[0] == course.start_speed == pytest.approx(winding)
    assert points.velocities[-1] == 0.0
    for kind in ("spline", "hermite"):  # a loop that is under way as well adds no blow
        output = played(course, points, Drive(bandwidth=60.0), kind)
        assert output.peak(2)[0] == pytest.approx(course.peaks[1], rel=2e-2)
    with pytest.raises(StudyError, match="start_dwell is 1 s, but the motion does not start"):
        with_dwells(course, 1.0, 0.0)
