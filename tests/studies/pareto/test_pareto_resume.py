"""A front that was killed goes on from its finished points, with the same result."""

import signal
from pathlib import Path

import numpy as np
import pytest

from studies.cli import main
from studies.common.exit_codes import ExitCode
from studies.common.result import Result
from tests.studies.stopped_runs import stopped_at

WORDS = ("--objectives", "time,peak-acceleration", "--duration", "4..6", "--points", "3")
STUDY = ("pareto", "truss", *WORDS, "--coarse", "--no-figures")
RESUME = ("pareto", "truss", "--no-figures", "--resume")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "number", "code", "kept"),
    [
        # within a search, between two points, and while a point is solved
        (
            "an end of the front: Ring truss, 24 modules, mu = 0, T from 4 to 6 s: minimum peak",
            signal.SIGKILL,
            -signal.SIGKILL,
            0,
        ),
        ("solve 5 of the front", signal.SIGKILL, -signal.SIGKILL, 5),
        ("solve 5 of the front", signal.SIGINT, ExitCode.INTERRUPTED, 5),
    ],
)
def test_a_front_that_was_stopped_goes_on_with_the_same_result(
    words: str, number: int, code: int, kept: int, tmp_path: Path, capsys, whole_front: Result
) -> None:
    out = tmp_path / "out"
    ended, messages = stopped_at(STUDY, words, number, out)
    assert ended == code
    assert f"to resume after an interruption: antenna-ocp pareto truss --resume {out}" in messages
    assert len(list(out.glob("steps/*/point-*"))) >= kept

    assert main([*RESUME, str(out)]) == ExitCode.OK
    lines = capsys.readouterr().err.splitlines()
    assert sum(line.endswith("found in an earlier run") for line in lines) >= kept
    found = Result.load(out)
    assert found.remarks == whole_front.remarks
    for name in ("time", "peak-acceleration", "limit", "price", "way", "dominated time"):
        # a solve from a stored neighbour repeats the one from the neighbour itself
        expected = whole_front.arrays[name].values
        assert np.allclose(found.arrays[name].values, expected, rtol=1e-9, atol=0.0), name


@pytest.fixture(scope="module")
def whole_front(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """The front of a run that nobody stops."""
    out = tmp_path_factory.mktemp("whole") / "out"
    assert main([*STUDY, "--results", str(out)]) == ExitCode.OK
    return Result.load(out)


def test_a_damaged_point_is_solved_again(tmp_path: Path) -> None:
    from ocp import Trial
    from studies.common.finished import FinishedSteps

    kept = FinishedSteps(tmp_path)
    kept.keep("point", Trial("001-4", None, RuntimeError("no motion"), float("nan"), 1.0))
    found = kept.read("point", "001-4", None)
    assert found is not None
    assert str(found.error) == "no motion"
    (tmp_path / "point-001-4.step").write_text("{")
    assert kept.read("point", "001-4", None) is None
