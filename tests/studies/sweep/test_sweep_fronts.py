"""Fronts under limits on a third quantity: a sweep whose cases are fronts."""

import csv
import tomllib
from pathlib import Path

import numpy as np
import pytest

from models.truss import DYNAMIC_SET
from studies.cli import main
from studies.common.exit_codes import ExitCode
from studies.common.result import Result
from studies.sweep.cases.plan import plan
from studies.sweep.config import study_from
from studies.sweep.figures import draw
from studies.sweep.subjects import subject, units
from studies.truss.config import DEPLOYED

FRONTS = """subject = "pareto truss"
coarse = true
[base]
pareto.objectives = ["time", "peak-acceleration"]
pareto.points = 3
duration = [4.0, 6.0]
[parameters]
"caps.speed" = [0.5, 0.8]
"""
STROKE = DEPLOYED - DYNAMIC_SET.stowed_angle
ARM = """subject = "pareto arm"
[base]
objectives = ["peak-torque", "deflection"]
[parameters]
duration = [8.0, 9.5]
"""


@pytest.mark.parametrize(("text", "unit"), [(FRONTS, "rad/s"), (ARM, "s")], ids=["truss", "arm"])
def test_fronts_are_planned_as_cases(text: str, unit: str) -> None:
    study = study_from(tomllib.loads(text))
    planned = plan(study)
    assert [case.refusal for case in planned.cases] == ["", ""]
    key = study.parameters[0].key
    swept, _ = subject(study.subject)
    assert units(swept, [key]) == {key: unit}


@pytest.mark.slow
def test_a_third_objective_is_a_sweep_of_fronts(tmp_path: Path) -> None:
    study, out = tmp_path / "fronts.toml", tmp_path / "out"
    study.write_text(FRONTS)
    assert main(["sweep", str(study), "--results", str(out), "--workers", "2"]) == ExitCode.OK
    with (out / "fronts.csv").open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    assert head == [
        *("case", "caps.speed [rad/s]", "time [s]", "peak-acceleration [rad/s^2]"),
        "price [rad/s^2/s]",
    ]
    values = np.array(rows, dtype=float)
    for cap in (0.5, 0.8):
        _, _, time, acceleration, price = values[values[:, 1] == cap].T
        assert time.size >= 6
        # half the way pushed and half braked, with a coast in between at the cap on the speed
        coasts = 2 * STROKE / time > cap
        coasting = cap**2 / (cap * time - STROKE)
        least = np.where(coasts, coasting, 4 * STROKE / time**2)
        # a point may lie above its front by some parts in ten thousand
        assert np.allclose(acceleration, least, rtol=1e-3)
        assert (acceleration >= least * (1 - 1e-6)).all()
        slope = np.where(coasts, coasting / (time - STROKE / cap), 2 * least / time)
        # the corner between both has two prices
        inside = np.abs(time - 2 * STROKE / cap) > 0.05
        assert np.allclose(price[inside], slope[inside], rtol=0.02)

    names = [name for name, _ in draw(Result.load(out))]
    assert names[0] == "fronts"
    assert (out / "fronts.png").is_file()
