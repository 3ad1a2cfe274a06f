"""A stored result without a solve: the law of least peak acceleration, which is in closed form."""

from collections.abc import Callable
from pathlib import Path

import pytest

from models.laws import JerkLimited
from studies.common.comparison_table import TableRow
from studies.common.result import Result, Verdict
from studies.truss.config import DEPLOYED, TrussStudy, as_dictionary
from studies.truss.motions.deployment import Deployment
from studies.truss.study import series_of


def stored(duration: float, multiple: float = 200.0) -> Result:
    """The result of a study of least peak acceleration, jerk capped at `multiple`/T^3."""
    study = TrussStudy(
        minimise="peak-acceleration", duration=duration, caps={"jerk": f"{multiple:g}/T^3"}
    )
    law = JerkLimited(duration, study.truss.stowed_angle, DEPLOYED, jerk=study.caps.jerk or 0.0)
    deployment = Deployment("optimal", law.profile, study.truss)
    return Result(
        kind="truss",
        question=study.question,
        configuration=as_dictionary(study),
        arrays=series_of(deployment),
        table=(
            TableRow(
                "peak-acceleration",
                "peak angular acceleration",
                "rad/s^2",
                {"optimal": law.peak_acceleration},
                minimised=True,
            ),
        ),
        verdict=Verdict("measured", "in closed form"),
    )


@pytest.fixture(scope="session")
def short() -> Result:
    """A deployment in 4 s, whose tables stay short."""
    return stored(4.0)


@pytest.fixture(scope="session")
def brisk() -> Result:
    """A deployment in 10 s at the Bezier law's peak jerk: its forces have no steps."""
    return stored(10.0, 124.22)


@pytest.fixture(scope="session")
def slow() -> Result:
    """The deployment of the main study: 140 s at the Bezier law's peak jerk, 124.22/T^3."""
    return stored(140.0, 124.22)


@pytest.fixture
def folder(short: Result, tmp_path: Path) -> Path:
    """A results folder of the short deployment."""
    path = tmp_path / "stored"
    path.mkdir()
    short.save(path)
    return path


@pytest.fixture
def drive_file(tmp_path: Path) -> Callable[[str], Path]:
    """Writes a drive of 16 bits on a drum of 20 mm, and further lines."""

    def write(lines: str = "") -> Path:
        path = tmp_path / "drive.toml"
        path.write_text(f"drum_radius = 0.02\ncounts = 65536\n{lines}\n", "utf-8")
        return path

    return write
