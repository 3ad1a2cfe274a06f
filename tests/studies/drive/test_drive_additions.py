"""What a table may add to a course's peaks: the bounds hold, and limits are lowered by them."""

import math

import pytest

from models.laws import JerkLimited
from models.truss import DYNAMIC_SET
from studies.common.exit_codes import StudyError
from studies.drive import Drive
from studies.drive.additions import additions, on_the_rope, wound_peaks
from studies.drive.course import drum_course, rope_course
from studies.drive.motor import shares_of_the_curve
from studies.drive.playback import loop_of, played, wound
from studies.drive.setpoints import sampled, switch_point_times, uniform_times
from studies.export.round_trip import Breach, Slack
from studies.export.within_limits import lowered, nearer

LAW = JerkLimited(10.0, DYNAMIC_SET.stowed_angle, math.pi / 2, jerk=0.2)
ROPE = rope_course(LAW.profile, DYNAMIC_SET)
ROUNDING = 1 + 1e-9  # the bounds are proven: only rounding of the sums may exceed them


@pytest.mark.parametrize("bandwidth", [None, 5.0, 50.0])
@pytest.mark.parametrize("counts", [None, 4096, 1048576])
@pytest.mark.parametrize("kind", ["linear", "hermite", "spline", "quintic"])
def test_speed_acceleration_and_jerk_stay_within_what_is_added(kind, counts, bandwidth) -> None:
    if kind == "linear" and bandwidth is None:
        pytest.skip("a line by itself has no bounded acceleration")
    drive = Drive(drum_radius=0.02, counts=counts, bandwidth=bandwidth)
    for times in (uniform_times(ROPE, 0.05), switch_point_times(ROPE, 90)):
        points = sampled(ROPE, times, drive.count("m"))
        output, found = played(ROPE, points, drive, kind), additions(ROPE, points, drive, kind)
        speed, acceleration, jerk = ROPE.peaks
        loop = loop_of(drive)
        # how far a loop magnifies the course itself is no part of what a table adds to a speed
        # or an acceleration
        own = 1.0 if loop is None else loop.overshoot
        assert output.peak(1)[0] <= (own * speed + found.speed) * ROUNDING
        gain = max(own, found.acceleration_gain)
        assert output.peak(2)[0] <= (gain * acceleration + found.acceleration) * ROUNDING
        assert output.peak(3)[0] <= (found.jerk_gain * jerk + found.jerk) * ROUNDING


def test_with_velocities_an_exact_table_adds_no_jerk() -> None:
    drive = Drive(drum_radius=0.02)
    points = sampled(ROPE, uniform_times(ROPE, 0.05))
    found = additions(ROPE, points, drive, "hermite")
    # the jerk of a cubic between two points is a weighted mean of the course's
    assert (found.jerk_gain, found.jerk) == (1.0, 0.0)
    assert played(ROPE, points, drive, "hermite").peak(3)[0] <= ROPE.peaks[2]


@pytest.mark.parametrize("turns", [1, 10])
def test_a_layered_drum_adds_the_climb(turns: int) -> None:
    drive = Drive(
        drum_radius=0.02, rope_diameter=0.003, layer_turns=turns, counts=65536, bandwidth=20.0
    )
    course = drum_course(ROPE, drive.drum)
    # the rope of the drum's course is the rope's own
    assert wound_peaks(course, drive.drum)[1:] == pytest.approx(ROPE.peaks[:2], rel=1e-6)
    points = sampled(course, uniform_times(course, 0.05), drive.count("rad"))
    output = wound(played(course, points, drive, "spline"), drive.drum)
    found = on_the_rope(additions(course, points, drive, "spline"), course, drive.drum)
    loop = loop_of(drive)
    assert loop is not None
    speed, acceleration, _ = ROPE.peaks
    assert output.peak(1)[0] <= loop.overshoot * speed + found.speed
    assert output.peak(2)[0] <= loop.overshoot * acceleration + found.acceleration
    # the drum stops to a count, on the outermost layer of 3.2 cm and less
    count = 2 * math.pi * 0.033 / 65536
    assert abs(output.motion[0, -1] - ROPE.travel) < count


def test_limits_of_the_motion_are_lowered_and_others_get_a_reserve() -> None:
    drive = Drive(
        drum_radius=0.02, counts=1048576, bandwidth=20.0, force=60.0, jerk=2.0, acceleration=2.0
    )
    points = sampled(ROPE, uniform_times(ROPE, 0.05), drive.count("m"))
    within, reserve = lowered(ROPE, points, drive, "hermite")
    found = additions(ROPE, points, drive, "hermite")
    assert within.acceleration == pytest.approx(2.0 - found.acceleration, rel=2e-5)
    assert within.jerk == pytest.approx((2.0 - found.jerk) / found.jerk_gain, rel=2e-5)
    assert within.force == pytest.approx(60.0, rel=2e-5)
    assert reserve.acceleration == found.acceleration > 0
    assert within.speed is None


def test_what_a_motion_breaks_inside_lower_limits_lowers_them_further() -> None:
    corners = [[0, 3.0], [100, 3.0], [300, 1.0]]
    drive = Drive(drum_radius=0.02, speed=2.0, power=50.0, torque_speed=corners)
    found = (
        Breach("speed", "m/s", 2.1, 2.0, 1.0),
        Breach("torque-speed curve", "of it", 1.05, 1.0, 1.0),
        Breach("acceleration", "m/s^2", math.nan, 1.0, 1.0),
        Slack(1.0, 1.0),
    )
    inside = nearer(drive, found)
    # a motion that was above by one part has to come down by more than that
    assert inside.speed is not None
    assert 0.9 * 2.0 < inside.speed < 2.0 * 2.0 / 2.1
    assert inside.power == 50.0
    for speed, torque in ((50.0, 2.0), (200.0, 1.5), (280.0, 0.5)):
        before = max(shares_of_the_curve(drive, speed, torque))
        share = inside.speed / 2.0
        assert max(shares_of_the_curve(inside, speed, torque)) == pytest.approx(before / share)
    # and further down with each round
    again = nearer(inside, found)
    assert again.speed is not None
    assert again.speed < inside.speed


def test_a_jerk_without_a_bound_is_refused() -> None:
    drive = Drive(drum_radius=0.02, rope_diameter=0.003, layer_turns=10, counts=65536, jerk=1.0)
    course = drum_course(ROPE, drive.drum)
    points = sampled(course, uniform_times(course, 0.05), drive.count("rad"))
    with pytest.raises(StudyError, match="the jerk has no bound between the points"):
        lowered(course, points, drive, "hermite")
    coarse = Drive(drum_radius=0.02, counts=65536, jerk=1.0)
    points = sampled(ROPE, uniform_times(ROPE, 0.01), coarse.count("m"))
    with pytest.raises(StudyError, match=r"may add .* to the jerk, but its limit is 1"):
        lowered(ROPE, points, coarse, "hermite")
