"""What the arm exports leaves what is stated, by SciPy on equations written anew."""

import json
from pathlib import Path

import numpy as np
import pytest

from models.arm.parameters import ArmParameters
from studies.cli import main
from studies.common.columns import Dialect
from studies.common.exit_codes import ExitCode
from tests.studies.arm.exported_links import Links, left_by
from tests.studies.written_columns import read_csv


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
@pytest.mark.parametrize("stage", ["big", "small"])  # angle drive is the quick one
def test_an_export_leaves_what_it_states(stage: str, tmp_path: Path) -> None:
    folder = tmp_path / "study"
    words = ["arm", "solve", "--stage", stage, "--objective", "smoothest", "--drive", "angle"]
    assert main([*words, "--no-figures", "--results", str(folder)]) == ExitCode.OK
    accuracy = json.loads((folder / "verification.json").read_text("utf-8"))["accuracy"]
    columns = read_csv((folder / "profile.csv").read_text("utf-8"), Dialect())
    # both integrate to about a per cent of the energy; below a nanojoule it is rounding
    stated = accuracy["residual_energy_of_the_sampled_profile_J"]
    assert left_by(columns, stage, "angle") == pytest.approx(stated, rel=0.05, abs=1e-9)
