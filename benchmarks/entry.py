"""What the commands `python -m benchmarks.NAME` share: errors in a sentence, flags, exit codes."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError

Command = Callable[[argparse.Namespace, Console], int]


def answer_for(
    parser: argparse.ArgumentParser, command: Command, arguments: Sequence[str] | None
) -> int:
    """Read the flags, run the command and return its exit code; an error is one sentence."""
    options, console = parser.parse_args(arguments), Console()
    try:
        return int(command(options, console))
    except StudyError as error:
        console.complain(str(error))
        return int(error.exit_code)
    except KeyboardInterrupt:
        console.complain("interrupted; what was measured until then is kept")
        return int(ExitCode.INTERRUPTED)


def add_results_flags(parser: argparse.ArgumentParser) -> None:
    """Add the two flags of every command that keeps results."""
    parser.add_argument("--results", type=Path, metavar="DIR", help="a new results folder")
    parser.add_argument("--overwrite", action="store_true", help="replace the results folder")


def positive(flag: str, text: str) -> float:
    """Return the positive, finite number after a flag.

    Raises
    ------
    StudyError
        If the text is no such number.
    """
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise StudyError(f"{flag} is {text!r}; give a positive number of seconds")
    return value


def whole(flag: str, text: str, least: int = 1) -> int:
    """Return the whole number after a flag.

    Raises
    ------
    StudyError
        If the text is no whole number, or one below `least`.
    """
    try:
        value = int(text)
    except ValueError:
        value = least - 1
    if value < least:
        kind = "positive whole number" if least == 1 else f"whole number of at least {least}"
        raise StudyError(f"{flag} is {text!r}; give a {kind}")
    return value
