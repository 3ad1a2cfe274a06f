"""A full disk, a read-only folder, a name that is too long: one sentence, at whatever step."""

import argparse
import errno
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import pytest

from studies.cli import parse
from studies.common.console import Console, silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.folder import ResultsFolder, open_results
from studies.common.result import Result, Verdict
from studies.common.running import carry_out
from studies.common.study import Study

FULL = OSError(errno.ENOSPC, "No space left on device")
RESULT = Result("test", "Is it kept?", {}, {}, verdict=Verdict("measured", "it was measured"))


def full(*arguments: object, **more: object) -> NoReturn:
    raise FULL


@dataclass(frozen=True)
class Stated:
    """A study without keys."""

    question: str = "Is it kept?"


def study(**changes: object) -> Study:
    parts = {"run": lambda stated, console: RESULT, "figures": lambda result: iter(())}
    nothing = {"name": "test", "summary": "", "keys": {}, "state": lambda stated: {}}
    return Study(**{**nothing, **parts, **changes})  # type: ignore[arg-type]


def refusal(asked: Study, folder: Path, console: Console) -> StudyError:
    options = argparse.Namespace(results=folder, overwrite=False, no_figures=False, resume=None)
    with pytest.raises(StudyError) as refused:
        carry_out(asked, Stated(), "test", options, console)
    assert refused.value.exit_code is ExitCode.NO_RESULTS_FOLDER
    return refused.value


@pytest.mark.parametrize("step", ["run", "files", "figures"])
def test_a_full_disk_is_one_sentence_at_every_step(step: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    said = str(refusal(study(**{step: full}), out, silent()))
    assert f"the results folder {out} cannot be written (No space left on device)" in said
    assert said.endswith(
        "free some space or correct its permissions, and give the same command again with "
        "--overwrite"
    )


def test_a_study_that_can_go_on_says_by_what(tmp_path: Path) -> None:
    asked = study(run=full, resumes=True)
    said = str(refusal(asked, tmp_path / "out", silent()))
    assert said.endswith(f"to resume: antenna-ocp test --resume {tmp_path / 'out'}")


def test_an_answer_that_cannot_be_written_is_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("studies.common.writers.write", full)
    refusal(study(), tmp_path / "out", Console())
    assert "it was measured" in capsys.readouterr().out


def test_why_nothing_was_found_is_said_even_if_it_cannot_be_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def infeasible(*given: object) -> NoReturn:
        raise StudyError("no motion meets the caps", ExitCode.INFEASIBLE)

    monkeypatch.setattr(ResultsFolder, "write_json", lambda *given: None)  # of the folder's mark
    monkeypatch.setattr(Result, "failed", full)
    refusal(study(run=infeasible), tmp_path / "out", Console())
    assert "no motion meets the caps" in capsys.readouterr().err


def test_what_is_no_matter_of_the_folder_stays_a_defect(tmp_path: Path) -> None:
    folder = ResultsFolder(tmp_path)
    with pytest.raises(FileNotFoundError), folder.written():
        (tmp_path.parent / "elsewhere" / "file").read_text("utf-8")
    with pytest.raises(BrokenPipeError), folder.written():
        raise BrokenPipeError(errno.EPIPE, "Broken pipe")
    (tmp_path / "taken").mkdir()
    with pytest.raises(StudyError, match="Is a directory"), folder.written():
        (tmp_path / "taken").write_text("", "utf-8")


def test_a_folder_whose_name_is_too_long_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="File name too long") as refused:
        open_results(tmp_path / ("x" * 3000), "test")
    assert len(str(refused.value)) < 600
    for command in ("truss", "sweep"):
        with pytest.raises(StudyError, match="a name of more than 255 characters"):
            parse([command, "study.toml", "--results", "x" * 3000])
