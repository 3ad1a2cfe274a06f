"""Motions of the arm keep their torques and times, and leave no more, while code moves.

`cases.json` holds what version 0.2.0 of this program found, or what it found later, if that is
better. Some cases leave more than the 1e-6 J that the study allows, and say so: they may get no
worse.
"""

import json
from pathlib import Path

import pytest

from studies.arm.optimal.objectives import RESIDUAL
from studies.arm.questions import one_motion
from studies.cli import main

CASES = json.loads(Path(__file__).with_name("cases.json").read_text())
SAME = 5e-3  # of a torque or a time, half of what a refinement counts as no change
WORSE = 1.05  # of a residual that is above what is allowed


@pytest.mark.slow
@pytest.mark.parametrize("words", CASES)
def test_a_motion_keeps_its_torque_and_its_time_and_leaves_no_more(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(one_motion, "LAWS", ())  # nothing is compared with baselines
    wanted, folder = dict(CASES[words]), tmp_path / "out"
    main(["arm", "solve", *words.split(), "--no-figures", "--results", str(folder)])
    found = json.loads((folder / "verification.json").read_text())["values"]
    residual = wanted.pop("residual_energy")
    assert found["residual_energy"] <= max(RESIDUAL, WORSE * residual)
    assert {key: found[key] for key in wanted} == pytest.approx(wanted, rel=SAME)
