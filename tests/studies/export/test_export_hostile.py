"""Texts of a result from elsewhere stay in their comment, in every format that there is."""

import dataclasses
import json
import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from studies.common.columns import flat
from studies.common.headers import cell, comments, one_line
from studies.common.result import Result, Verdict
from studies.export.command import FORMATS
from tests.studies.export.command_line import export

Write = Callable[[str], Path]

HOSTILE = (
    "a\n=cmd|' /C calc'!A0",
    "a\r\nPVA=1,2,3\r\nBT A",
    "a */ int evil(void) { return 1; } /* b",
    "a *) END_VAR VAR_GLOBAL evil : BOOL; (* b",
    "a\x0b=1\x0c=2\x1c=3\x85=4\u2028=5\u2029=6",
    "a,=cmd|'x'!A0;+1+1;\t@SUM(1)|-2+3",
    "=cmd|' /C calc'!A0",
    "@SUM(A1)",
    "a \\",
)
PLAIN = tuple(f"motion {number}" for number in range(len(HOSTILE)))
CELL = re.compile(r"[,;\t]")


def spoken(result: Result, texts: tuple[str, ...]) -> Result:
    """The same with texts wherever it has some of its own: sentences, names and values."""
    question, verdict, profile_of, how_to_read = texts[:4]
    sentences = {"profile_of": profile_of, "how_to_read": how_to_read}
    return dataclasses.replace(
        result,
        question=question,
        verdict=Verdict("measured", verdict),
        details={**result.details, **sentences, "accuracy": dict.fromkeys(texts, 1)},
        provenance={text: text for text in texts},
        configuration={**result.configuration, "caps": {}},
    )


def written(result: Result, form: str, texts: tuple[str, ...], folder: Path, drive: Path) -> bytes:
    """The file of a format, of a result that says some texts."""
    folder.mkdir()
    spoken(result, texts).save(folder)
    file = folder / "out"
    words = ("--to", form, "--drive", drive, "--points", 9, "--output", file)
    assert export(folder, *words) == 0
    return file.read_bytes()


@pytest.mark.parametrize("form", FORMATS)
def test_a_text_stays_in_its_comment(
    form: str, brisk: Result, drive_file: Write, tmp_path: Path
) -> None:
    if form == "parquet":
        pytest.importorskip("pyarrow")
    drive = drive_file("interpolation = 'spline'\nperiod = 1.0")
    plain = written(brisk, form, PLAIN, tmp_path / "plain", drive)
    for first in range(0, len(HOSTILE), 4):  # each of them is a sentence once
        texts = HOSTILE[first:] + HOSTILE[:first]
        content = written(brisk, form, texts, tmp_path / str(first), drive)
        if form in ("json", "segments"):  # quotes of its own keep a text as it is
            said = json.loads(content)
            assert said.get("about", said)["question"] == texts[0]
            continue
        if form in ("mat", "parquet"):  # no text that a spreadsheet or compiler reads
            continue
        _same_but_for_comments(plain.decode("utf-8"), content.decode("utf-8"), form)


def _same_but_for_comments(plain: str, content: str, form: str) -> None:
    """Line by line the same, but for lines that are comments in both, and no formula anywhere."""
    expected, found = plain.splitlines(), content.splitlines()
    assert len(found) == len(expected)
    for ours, theirs in zip(expected, found, strict=True):
        if ours != theirs:
            opening = re.match(r"# |// | \* ", ours)
            assert opening is not None
            assert theirs.startswith(opening[0])
            text = theirs.removeprefix(opening[0])
            assert not re.search(r"\*/|/\*|\*\)|\(\*", text)
        elif form == "c99":  # a line of the code, such as `--k`
            continue
        for one in CELL.split(theirs):
            begun = one.strip(" {}[]()")
            assert not begun.startswith(("=", "+", "-", "@")) or math.isfinite(float(begun))


def test_a_header_of_columns_begins_no_formula(
    brisk: Result, drive_file: Write, tmp_path: Path
) -> None:
    hostile = dataclasses.replace(brisk.arrays["angle"], unit="rad\n=1+1")
    arrays = {**brisk.arrays, "angle": hostile, "=cmd|'x'!A0": brisk.arrays["angle"]}
    path = tmp_path / "named"
    path.mkdir()
    dataclasses.replace(brisk, arrays=arrays).save(path)
    file = tmp_path / "out.csv"
    assert export(path, "--to", "csv", "--output", file) == 0
    lines = file.read_text("utf-8").splitlines()
    (head,) = [line for line in lines if line.startswith("time [s]")]
    assert "rad =1+1]" in head
    assert "'=cmd|'x'!A0 [rad]" in head
    assert not any(one.startswith("=") for one in CELL.split(head))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("peak at -1.5, +2; -3e-4", "peak at -1.5, +2; -3e-4"),
        ("a,=1", "a,'=1"),
        ("a; -b", "a; '-b"),
        ("-2+3", "'-2+3"),
        ("@x", "'@x"),
        ("x**/", "x** /"),
        ("/*)", "/ * )"),
    ],
)
def test_numbers_stay_as_they_are_and_formulas_are_texts(text: str, said: str) -> None:
    assert cell(text) == said


def test_one_line_is_printable_and_short_of_nothing() -> None:
    assert one_line("a\x00b\u202ec\td  e") == "a b c d e"
    assert comments(flat({"a": {"b\n=": "c\nd"}})) == ["# a.b = = c d"]
