"""`antenna-ocp export`: the profile of a stored result in a format that other programs read."""

from __future__ import annotations

import argparse
from pathlib import Path

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError

FORMATS = ("csv", "json")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument("results", type=Path, metavar="RESULTS", help="a results folder")
    parser.add_argument("--to", required=True, choices=FORMATS, help="the format")
    parser.add_argument(
        "--output", type=Path, metavar="FILE", help="a new file; printed if there is none"
    )


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Write the profile."""
    from studies.common.result import Result
    from studies.common.writers import profile_csv, profile_json

    result = Result.load(options.results)
    if not result.arrays:
        raise StudyError(f"the result in {options.results} has no arrays to export")
    text = profile_csv(result) if options.to == "csv" else profile_json(result)

    if options.output is None:
        console.say(text.rstrip("\n"))
        return ExitCode.OK
    try:
        # never over a file that is there: it may be the only copy
        with options.output.open("x", encoding="utf-8", newline="") as file:
            file.write(text)
    except OSError as error:
        raise StudyError(
            f"the file {options.output} cannot be written ({error.strerror}); name another one",
            ExitCode.NO_RESULTS_FOLDER,
        ) from error
    return ExitCode.OK
