"""The command: bad input, and what was measured is kept whenever it stops."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.parts import PARTS, Measured, Setup, part
from benchmarks.race import medians
from benchmarks.race.__main__ import main
from benchmarks.speed import imports
from studies.common.console import Table


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--only", "rase"), "the parts are race"),
        (("--repeats", "0"), "positive whole number"),
        (("--repeats", "2.5"), "positive whole number"),
        (("--limit", "-3"), "positive number of seconds"),
        (("--limit", "inf"), "positive number of seconds"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: tuple[str, ...], words: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main([*arguments, "--results", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert words in line
    assert not (tmp_path / "out").exists()


def test_what_was_measured_before_an_interruption_is_kept(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    def measure(setup: Setup) -> Iterator[Measured]:
        assert setup.repeats == 2
        yield {"rows": [], "seconds": 1.0}
        raise KeyboardInterrupt

    monkeypatch.setattr(medians, "measure", measure)
    monkeypatch.setattr(medians, "tables", lambda record: [Table("T", ("s",), [("1",)])])
    out = tmp_path / "out"
    arguments = ["--only", "race", "--repeats", "2", "--results", str(out)]
    assert main(arguments) == 130
    assert json.loads((out / "race.json").read_text())["seconds"] == 1.0
    assert (out / "race.txt").is_file()
    assert "interrupted" in capsys.readouterr().out


def test_every_part_has_what_a_part_needs(capsys: pytest.CaptureFixture[str]) -> None:
    for name in PARTS:
        module = part(name)
        assert all(callable(getattr(module, verb)) for verb in ("measure", "tables"))
    assert main(["--list"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(PARTS)


def test_starts_have_medians_and_their_ratio() -> None:
    seconds = {name: [1.0, 2.0, 9.0] for name in imports.STARTS}
    seconds[imports.RATIO[0]] = [3.0]
    (table,) = imports.tables({"seconds": seconds})
    assert dict(table.rows)["python alone"] == "2"
    assert "takes 1.50 times" in table.notes[0]
