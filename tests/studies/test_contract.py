"""What each command answers, through its one door: exit code, files and numbers of a coarse run.

The numbers are those of version 0.1.0 of this program; where another source has one, it is named.
They hold while code moves: a value that is minimised to 1e-5 of it, others to 1e-3, as what is not
minimised may differ a little between motions of the same value.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from studies.cli import main

pytestmark = pytest.mark.slow

RECORDS = {"arrays.npz", "input.toml", "provenance.json", "result.json", "table.txt"}
PROFILE = {"profile.csv", "profile.json"}
ROBUST = """duration = 140
[caps]
jerk = "bezier"
[truss]
modules = 6
[robust]
draws = 200
[robust.scenarios.rough]
pulley_friction = 0.015
"""


@dataclass(frozen=True)
class Answer:
    """A coarse run of a command.

    Attributes
    ----------
    words : after the name of the command; STUDY is a file with `study`.
    least : the values that it minimises.
    others : further values.
    files : that it writes besides `RECORDS`.
    """

    words: str
    least: Mapping[str, float] = field(default_factory=dict)
    others: Mapping[str, float] = field(default_factory=dict)
    files: frozenset[str] = frozenset(PROFILE)
    study: str = ""


ANSWERS = {
    # 4 x angle / T^2, as of a mass that is pushed half the way and braked the other half
    "truss": Answer(
        "--objective peak-acceleration --duration 5 --intervals 8",
        {"peak-acceleration": 0.239040294},
        {"peak-speed": 0.597600736, "peak-force": 43.2718699, "energy": 123.223291},
    ),
    "arm solve": Answer(
        "--stage big --elements 3",
        {"mean_square_torque": 18.0168477},
        {"peak_root_torque": 6.38547564, "peak_root_force": 5.96021766, "work": 3.19440282},
    ),
    "arm baselines": Answer(
        "--stage big",
        others={"peak_root_torque": 6.11937654, "optimum_peak_root_torque": 6.10538336},
    ),
    "codesign": Answer(
        "--objective peak-force --duration 140 --jerk-cap bezier --modules 6",
        {"peak-force": 9.57766764},
        {"crank": 0.106523841, "link": 0.195, "spring_stiffness": 130, "holding-force": 9.40983006},
        frozenset(PROFILE | {"prices.csv"}),
    ),
    "robust truss": Answer(
        "STUDY",
        {"worst-force": 12.6001314},
        {"nominal-peak": 9.7388, "rough-peak": 12.6001314, "rough-least": 1.41455790},
        study=ROBUST,
    ),
    "flex": Answer(
        "--preset double-pendulum",
        others={"angle_0": -145.838003, "angle_1": -85.2702799, "tip_x": -2.57925976},
    ),
    "paper": Answer(
        "--elements 2",
        others={"table-1-length-simple-pendulum": 1.2, "4-5-mass-matrix-constant": 0.0},
    ),
}


def run(name: str, words: Sequence[str], folder: Path) -> int:
    """The exit code of a command."""
    return main([*name.split(), *words, "--results", str(folder)])


@pytest.mark.parametrize("name", ANSWERS)
def test_a_command_writes_the_same_files_with_the_same_numbers(name: str, tmp_path: Path) -> None:
    answer, folder, study = ANSWERS[name], tmp_path / "out", tmp_path / "study.toml"
    study.write_text(answer.study)
    words = [str(study) if word == "STUDY" else word for word in answer.words.split()]
    assert run(name, [*words, "--no-figures"], folder) == 0
    written = {path.name for path in folder.iterdir()}
    record = json.loads((folder / "verification.json").read_text())
    assert record["passed"]
    for tolerance, values in ((1e-5, answer.least), (1e-3, answer.others)):
        for key, value in values.items():
            found = record["values"][key]
            assert found == pytest.approx(value, rel=tolerance, abs=1e-12), key
    assert written >= RECORDS | answer.files
