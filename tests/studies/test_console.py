"""Progress: a line every few seconds, and numbers that stay visible; messages, the fact first."""

import io
import re
import time

import pytest

from studies.common import console as consoles
from studies.common.console import LONGEST_LINE, Console, at_work, fitted, in_lines


def test_a_quiet_console_says_where_the_work_stands(monkeypatch):
    monkeypatch.setattr(consoles, "QUIET", 0.05)
    monkeypatch.setattr(consoles, "_LOOK", 0.01)
    said = io.StringIO()
    with at_work(Console(io.StringIO(), said)) as told:
        told.progress("solving")
        for _ in range(1000):  # up to 10 s
            if "still working" in said.getvalue():
                break
            time.sleep(0.01)
    lines = said.getvalue().splitlines()
    assert len(lines) >= 2
    assert re.search(r"still working, \d+ s after: solving", lines[-1])

    # and nothing once the work is done
    time.sleep(0.1)
    assert said.getvalue().splitlines() == lines


@pytest.mark.parametrize("width", [60, 79])
def test_a_label_is_shortened_and_not_the_numbers(width):
    numbers = "mesh iteration 4 (77 intervals), iteration 12"
    line = fitted(f"[  25.0 s] start 2 of 5, big arm, dwell, small arm: {numbers}", width)
    assert len(line) == width
    assert line.endswith(f"...: {numbers}")


@pytest.mark.parametrize(
    ("message", "lines"),
    [
        ("fact; remedy", ["fact; remedy"]),
        ("f" * 150 + "; " + "r" * 90, ["f" * 150 + ";", "  " + "r" * 90]),
        ("a; b; " + "r" * 195, ["a; b;", "  " + "r" * 195]),
        (" ".join(["word-s"] * 40), [" ".join(["word-s"] * 28), "  " + " ".join(["word-s"] * 12)]),
        ("fact\n  in a table", ["fact", "  in a table"]),
        ("", [""]),
    ],
)
def test_long_messages_are_parted(message: str, lines: list[str]) -> None:
    assert in_lines(message) == "\n".join(lines)
    assert max(map(len, lines)) <= LONGEST_LINE + 2
