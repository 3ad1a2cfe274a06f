"""What the arm exports leaves what is stated, by SciPy on equations written anew."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.shows.arm.exports import MOTIONS, Links, answer, left_by, question
from models.arm.parameters import ArmParameters
from studies.common.exit_codes import ExitCode


def test_the_masses_are_those_of_the_arm() -> None:
    arm = ArmParameters()
    links = Links(arm, (True, True))
    along_x = np.tile([1.0, 0.0, 0.0, 0.0], 2 * 9)
    mass = arm.big.linear_density * 3.0 + arm.small.linear_density * 2.0 + 30.0
    assert along_x @ links.mass @ along_x == pytest.approx(mass, rel=1e-12)


def test_an_arm_that_stands_still_is_left_with_nothing() -> None:
    time = np.linspace(0.0, 0.1, 11)
    still = {"time": time, "root_torque": 0.0 * time, "elbow_angle": np.pi + 0.0 * time}
    assert left_by(still, "big", "torque") < 1e-20
    assert left_by(still, "small", "angle") < 1e-20


@pytest.mark.slow
@pytest.mark.parametrize("index", [1, 3])  # those under angle drive are the quick ones
def test_an_export_leaves_what_it_states(index: int, tmp_path: Path) -> None:
    assert MOTIONS[index][1] == "angle"
    row = answer(question(0, index), tmp_path)
    assert row["code"] == ExitCode.OK
    assert row["agrees"], row
