"""What a motor does for a rope: a drum of one layer and of several, and the torque-speed curve."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad

from studies.common.configuration import as_stated, toml_text
from studies.common.exit_codes import StudyError
from studies.drive.motor import (
    motor_speed,
    motor_torque,
    motor_turn,
    rope_force_of,
    shares_of_the_curve,
)
from studies.drive.schema import Drive, drive_from, read_drive

PLAIN = Drive(drum_radius=0.02, gear_ratio=20.0, efficiency=0.8)
LAYERED = Drive(drum_radius=0.02, gear_ratio=20.0, rope_diameter=0.003, layer_turns=10)
CURVED = Drive(drum_radius=0.02, torque_speed=[[0, 3.0], [100, 3.0], [300, 1.0], [350, 0]])


def test_a_motor_delivers_the_power_of_its_rope_over_the_efficiency() -> None:
    speed, torque = motor_speed(PLAIN, 0.7, 1.0), motor_torque(PLAIN, 60.0, 1.0)
    assert speed * torque == pytest.approx(0.7 * 60.0 / 0.8, rel=1e-14)
    assert speed == pytest.approx(20 * 0.7 / 0.02, rel=1e-14)
    assert rope_force_of(PLAIN, torque) == pytest.approx(60.0, rel=1e-14)


def test_the_shaft_turns_by_what_its_speed_adds_up_to() -> None:
    edges = [0.0, *LAYERED.drum.corners(6.61), 6.61]
    turn = sum(
        quad(lambda s: motor_speed(LAYERED, 1.0, s), low, high, epsrel=1e-12)[0]
        for low, high in itertools.pairwise(edges)
    )
    assert motor_turn(LAYERED, 6.61) == pytest.approx(turn, rel=1e-10)
    assert motor_turn(LAYERED, 6.61) < motor_turn(PLAIN, 6.61) == pytest.approx(20 * 6.61 / 0.02)


def test_the_curve_is_kept_where_no_share_is_above_one() -> None:
    speeds = np.linspace(0.0, 360.0, 721)
    corners = np.array(CURVED.torque_speed)
    curve = np.interp(speeds, *corners.T)
    inside = speeds <= 350.0
    on_it = np.max(shares_of_the_curve(CURVED, speeds, curve), axis=0)
    assert on_it[inside] == pytest.approx(1.0, abs=1e-14)
    assert (on_it[~inside] > 1.0).all()
    assert (np.max(shares_of_the_curve(CURVED, speeds, 0.9 * curve), axis=0)[inside][:-1] < 1).all()
    # one corner is a motor with a limit of torque and one of speed
    box = Drive(drum_radius=0.02, torque_speed=[[200, 2.0]])
    assert shares_of_the_curve(box, 100.0, 1.0) == (0.5, 0.5)
    assert shares_of_the_curve(PLAIN, 1.0, 1.0) == ()


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"efficiency": 1.2}, "give a fraction of at most 1"),
        ({"rope_diameter": 0.003}, "belong together"),
        ({"rope_diameter": 0.003, "layer_turns": 0.5}, "has at least 1 turn"),
        ({"rope_diameter": 0.05, "layer_turns": 5}, "at least half the diameter"),
        ({"drum_radius": "none", "motor_torque": 1.0}, "add drum_radius"),
        ({"torque_speed": [[0, 1], [10]]}, "give corners such as"),
        ({"torque_speed": 3}, "give corners such as"),
        ({"torque_speed": [[0, 1], [10, 1.5]]}, "is not at 0 rad/s"),
        ({"torque_speed": [[0, 3], [10, 1], [20, 0.5]]}, "is not at 10 rad/s"),
        ({"torque_speed": [[10, 3], [10, 1]]}, "give increasing speeds"),
        ({"torque_speed": [[0, 0], [10, 0]]}, "no torque or no speed"),
    ],
)
def test_a_motor_that_cannot_be_is_refused(keys, said) -> None:
    with pytest.raises(StudyError, match=said):
        drive_from({"drum_radius": 0.02, **keys})


def test_counts_of_rope_on_a_drum_of_several_layers_are_refused() -> None:
    layered = Drive(drum_radius=0.02, rope_diameter=0.003, layer_turns=10, counts=4096)
    with pytest.raises(StudyError, match="drum of several layers"):
        layered.count("m")


def test_a_drive_comes_back_from_its_file(tmp_path) -> None:
    path = tmp_path / "drive.toml"
    path.write_text(toml_text(as_stated(CURVED)), "utf-8")
    assert read_drive(path) == CURVED
