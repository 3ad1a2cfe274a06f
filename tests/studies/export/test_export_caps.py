"""The record says of every cap of a study how far a played table is beyond it."""

import dataclasses
import math

import pytest

from models.laws import JerkLimited
from studies.drive import Drive
from studies.drive.course import rope_course
from studies.drive.playback import on_the_truss, played
from studies.drive.setpoints import sampled, switch_point_times
from studies.export.beyond_caps import BeyondCap, beyond_caps
from studies.truss.config import DEPLOYED, TrussStudy
from studies.truss.limits.caps import CAPPED
from studies.truss.motions.deployment import Deployment
from studies.truss.quantities import QUANTITIES

DRIVE = Drive(
    drum_radius=0.02,
    interpolation="quintic",
    torque_speed=[[0, 1.0], [300, 0.0]],
    motor_inertia=2e-4,
)
STUDY = TrussStudy(
    minimise="peak-acceleration",
    duration=4.0,
    drive=DRIVE,
    margin={"preset": "aiaa-s-114"},
)
LAW = JerkLimited(4.0, STUDY.truss.stowed_angle, DEPLOYED, jerk=3.0).profile
OF_A_HELD_RING = [key for key in CAPPED if QUANTITIES[key].needs != "arm"]
DEPLOYMENT = Deployment("optimal", LAW, STUDY.truss, DRIVE, STUDY.margin)


def lines(study: TrussStudy, drive: Drive) -> dict[str, float]:
    course = rope_course(LAW, study.truss)
    output = played(course, sampled(course, switch_point_times(course, 400)), drive)
    replayed = on_the_truss(output.motion, study.truss)
    return dict(one.line for one in beyond_caps(output, replayed, drive, study))


def capped(factor: float) -> TrussStudy:
    caps = {CAPPED[key]: factor * DEPLOYMENT.values[key] for key in OF_A_HELD_RING}
    caps["least_tension"] = DEPLOYMENT.values["least-tension"] + (1 - factor)
    return dataclasses.replace(STUDY, caps=caps)


def test_every_cap_that_is_broken_has_its_line() -> None:
    found = lines(capped(0.8), DRIVE)
    for key in (*OF_A_HELD_RING, "peak-motor-load"):
        name = f"{QUANTITIES[key].title} beyond the cap of the study [1]"
        if key == "peak-motor-load":
            expected = DEPLOYMENT.values[key] - 1.0
        elif key == "least-tension":
            name, expected = f"{QUANTITIES[key].title} short of the cap of the study [N]", 0.2
        else:
            expected = 1 / 0.8 - 1
        # points on the switches: a quintic follows all but the steps of the jerk
        assert found[name] == pytest.approx(expected, rel=5e-3), key


@pytest.mark.parametrize(
    ("value", "cap", "said"),
    [
        (0.000587, 0.003, "0.000587 N (80 % short of the cap of 0.003)"),
        (4.3e-10, 0.003, "4.3e-10 N (100 % short of the cap of 0.003)"),
        (-2.0, 0.003, "-2 N (a slack rope; the cap is 0.003)"),
        (-2.0, 0.0, "-2 N (a slack rope; the cap is 0)"),
    ],
)
def test_a_tension_is_short_of_its_own_cap_and_not_of_the_force(
    value: float, cap: float, said: str
) -> None:
    title = QUANTITIES["least-tension"].title
    short = BeyondCap("least-tension", value, cap)
    assert short.words == f"{title} {said}"
    assert short.line == (f"{title} short of the cap of the study [N]", cap - value)


@pytest.mark.parametrize(
    ("excess", "said"),
    [(0.00126, "0.13 % above"), (0.82, "82 % above"), (3.94, "390 % above"), (7029, "7000 times")],
)
def test_what_exceeds_a_cap_is_said_in_plain_numbers(excess: float, said: str) -> None:
    jerk = BeyondCap("peak-jerk", 2.0 * (1 + excess), 2.0)
    assert jerk.words.endswith(f"({said} the cap of 2)")


def test_what_has_no_value_between_the_points_is_said_and_not_passed_over() -> None:
    study = capped(1.2)
    # nothing is beyond but the curve, which this motor does not keep
    assert set(lines(study, DRIVE)) == {
        "largest share of the torque-speed curve beyond the cap of the study [1]"
    }
    found = lines(study, dataclasses.replace(DRIVE, interpolation="linear"))
    assert math.isnan(found["peak angular acceleration beyond the cap of the study [1]"])
    assert math.isnan(found["largest force in a bar beyond the cap of the study [1]"])
    assert "peak rope speed beyond the cap of the study [1]" not in found
