"""`antenna-ocp export` as its tests call it."""

import dataclasses
import io
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from studies.cli import main
from studies.common.result import Result


def export(*words: object) -> int:
    """The exit code of the command."""
    return main(["export", *map(str, words)])


def rubbed(result: Result, friction: float, tmp_path: Path) -> Path:
    """A folder with the same motion on a truss whose pulleys rub."""
    path = tmp_path / "rubbed"
    path.mkdir()
    truss = {**result.configuration["truss"], "pulley_friction": friction}
    dataclasses.replace(result, configuration={**result.configuration, "truss": truss}).save(path)
    return path


def complaint(capsys: pytest.CaptureFixture[str]) -> str:
    """What the command wrote to standard error."""
    return capsys.readouterr().err


def read_mat(content: bytes) -> dict[str, np.ndarray]:
    """Columns of a MATLAB file."""
    loaded = loadmat(io.BytesIO(content))
    names = (name for name in loaded if not name.startswith("__"))
    return {name: np.ravel(loaded[name]) for name in names if name not in ("units", "about")}
