"""Messages: the fact in the first line, the remedy below it if both are long."""

import pytest

from studies.common.console import LONGEST_LINE, in_lines


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
