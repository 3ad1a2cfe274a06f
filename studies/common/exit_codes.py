"""What the exit code of `antenna-ocp` means, the error that carries one, and values in errors."""

import re
from datetime import date, time
from enum import IntEnum
from typing import Any

SHOWN = 120  # characters of a value that a message repeats: a line and a half of a terminal
RUN_ON = re.compile(r"\S{400,}")  # a word that no path or name is as long as


class ExitCode(IntEnum):
    """Exit code of the command; `meaning` is its sentence for `--help` and the README."""

    OK = 0, "done; every check passed"
    BAD_INPUT = 2, "a flag, a file or a value is wrong; nothing was computed"
    INFEASIBLE = 3, "proved infeasible: no motion meets the caps; or no minimum exists"
    NOT_SOLVED = (
        4,
        "no motion was found (no proof that there is none); the inputs are kept",
    )
    NOT_VERIFIED = 5, "a result or a profile was computed, but a check failed; see its record"
    NO_RESULTS_FOLDER = 6, "the results folder exists already or cannot be written"
    INTERNAL = 70, "a defect of this program; a report was written to the file named"
    INTERRUPTED = 130, "interrupted (Ctrl-C); the results so far are kept"

    meaning: str

    def __new__(cls, value: int, meaning: str) -> "ExitCode":
        member = int.__new__(cls, value)
        member._value_ = value
        member.meaning = meaning
        return member


class StudyError(Exception):
    """One clear sentence for the user, and the exit code that goes with it."""

    def __init__(self, sentence: str, exit_code: ExitCode = ExitCode.BAD_INPUT) -> None:
        # names of keys, flags and files are not quoted, and may be as long as values
        super().__init__(RUN_ON.sub(lambda word: _ends(word[0], SHOWN), sentence))
        self.exit_code = exit_code


def quoted(value: Any) -> str:
    """A value as a sentence shows it: in full, or its two ends where it is long.

    A sentence is read in a line or two of a terminal, and a list that was pasted has thousands.
    """
    counted = f" ({len(value)} values)" if isinstance(value, list | tuple) else ""
    text = value.isoformat() if isinstance(value, date | time) else repr(value)
    return _ends(text, SHOWN) + (counted if len(text) > SHOWN else "")


def _ends(text: str, longest: int) -> str:
    """A text, or its two ends where it is longer than that."""
    return text if len(text) <= longest else f"{text[: longest - 20]} ... {text[-12:]}"


def exit_code_table() -> str:
    """Return the documentation of all exit codes, a line each."""
    return "\n".join(f"  {code.value:>3}  {code.meaning}" for code in ExitCode)
