"""`python -m benchmarks.race`: seconds and memory, beside other tools, and as problems grow."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from benchmarks.entry import add_results_flags, answer_for, positive, whole
from benchmarks.parts import PARTS, Measured, Setup, part
from benchmarks.records import ROOT
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError

if TYPE_CHECKING:
    from studies.common.folder import ResultsFolder

NAME = "race"


def build_parser() -> argparse.ArgumentParser:
    """Return the flags of the command."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.race",
        description="Each row is a fresh process; medians of interleaved runs. Tables are "
        "printed, and kept with JSON as soon as a part is done.",
    )
    parser.add_argument(
        "--peers", action="store_true", help="with other tools, each installed on its own first"
    )
    parser.add_argument("--only", nargs="+", metavar="PART", help="parts to run; all if none")
    parser.add_argument("--repeats", default="5", metavar="N", help="runs to take medians of [5]")
    parser.add_argument(
        "--limit", default="120", metavar="S", help="seconds that a run may last [120]"
    )
    add_results_flags(parser)
    parser.add_argument("--list", action="store_true", help="list the parts")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    return answer_for(build_parser(), run, arguments)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Measure part after part; print and keep each."""
    from studies.common.folder import open_results

    if options.list:
        console.say("\n".join(f"{name:12} {line}" for name, (_, line) in PARTS.items()))
        return ExitCode.OK

    # All flags are read before the folder is made: bad input leaves nothing behind.
    names = _chosen(options.only)
    setup = Setup(
        console=console,
        repeats=whole("--repeats", options.repeats),
        limit=positive("--limit", options.limit),
        peers=options.peers,
        environments=ROOT / "results" / "environments",
    )
    folder = open_results(options.results, NAME, options.overwrite)

    for name in names:
        if not _measured(name, setup, folder):
            console.say(f"\ninterrupted; what was measured until then is in {folder.path}")
            return ExitCode.INTERRUPTED
    folder.complete()
    console.say(f"\neverything is in {folder.path}")
    return ExitCode.OK


def _chosen(asked: Sequence[str] | None) -> list[str]:
    for name in asked or ():
        if name not in PARTS:
            raise StudyError(f"there is no part {name!r}; the parts are {', '.join(PARTS)}")
    return [name for name in PARTS if not asked or name in asked]


def _measured(name: str, setup: Setup, folder: ResultsFolder) -> bool:
    """Measure one part and keep its record, as it grows; whether it was finished."""
    record, finished = None, False
    setup.console.progress(f"part {name}")
    try:
        for record in part(name).measure(setup):
            folder.write_json(f"{name}.json", record)
        finished = True
    except KeyboardInterrupt:
        pass  # what the record holds by now is reported below

    if record is not None:
        _report(name, record, setup.console, folder)
    return finished


def _report(name: str, record: Measured, console: Console, folder: ResultsFolder) -> None:
    """Print the tables of a part and write them."""
    text = "\n\n".join(str(table) for table in part(name).tables(record))
    console.say(f"\n{text}")
    folder.file(f"{name}.txt").write_text(f"{text}\n", "utf-8")


if __name__ == "__main__":
    sys.exit(main())
