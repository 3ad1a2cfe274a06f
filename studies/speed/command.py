"""`antenna-ocp benchmark-speed`: seconds and memory, beside other tools, and as problems grow."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError

if TYPE_CHECKING:
    from studies.common.folder import ResultsFolder
    from studies.speed.setup import Record, Setup

NAME = "speed"


def add_to(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the sub-command."""
    parser = subparsers.add_parser(
        "benchmark-speed",
        help="seconds and memory, beside other tools, and as problems grow",
        description="Each row is a fresh process; medians of interleaved runs. Tables are "
        "printed, and kept with JSON and figures as soon as a part is done.",
    )
    parser.add_argument(
        "--peers", action="store_true", help="with other tools, each installed on its own first"
    )
    parser.add_argument("--only", nargs="+", metavar="PART", help="parts to run; all if none")
    parser.add_argument("--repeats", default="5", metavar="N", help="runs to take medians of [5]")
    parser.add_argument(
        "--limit", default="120", metavar="S", help="seconds that a run may last [120]"
    )
    parser.add_argument("--results", type=Path, metavar="DIR", help="a new results folder")
    parser.add_argument("--overwrite", action="store_true", help="replace the results folder")
    parser.add_argument("--list", action="store_true", help="list the parts")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Measure part after part; print and keep each."""
    from studies.common.folder import DEFAULT_PARENT, open_results
    from studies.speed.setup import PARTS, Setup

    if options.list:
        console.say("\n".join(f"{name:12} {what}" for name, what in PARTS.items()))
        return ExitCode.OK
    names = _chosen(options.only, PARTS)
    repeats = int(_positive("--repeats", options.repeats, whole=True))
    limit = _positive("--limit", options.limit)
    folder = open_results(options.results, NAME, options.overwrite)
    environments = DEFAULT_PARENT / "environments"
    setup = Setup(console, repeats, limit, options.peers, environments)
    for name in names:
        if not _measured(name, setup, folder):
            console.say(f"\ninterrupted; what was measured until then is in {folder.path}")
            return ExitCode.INTERRUPTED
    folder.complete()
    console.say(f"\neverything is in {folder.path}")
    return ExitCode.OK


def _chosen(asked: list[str] | None, known: Mapping[str, str]) -> list[str]:
    for name in asked or ():
        if name not in known:
            raise StudyError(f"there is no part {name!r}; the parts are {', '.join(known)}")
    return [name for name in known if not asked or name in asked]


def _positive(flag: str, text: str, whole: bool = False) -> float:
    """The positive number after a flag."""
    try:
        value = float(int(text)) if whole else float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        kind = "whole number" if whole else "number of seconds"
        raise StudyError(f"{flag} is {text!r}; give a positive {kind}")
    return value


def _measured(name: str, setup: Setup, folder: ResultsFolder) -> bool:
    """Measure one part and keep its record, as it grows; whether it was finished."""
    from studies.speed.setup import part

    module, record, done = part(name), None, False
    setup.console.progress(f"part {name}")
    try:
        for record in module.measure(setup):
            folder.write_json(f"{name}.json", record)
        done = True
    except KeyboardInterrupt:
        pass
    if record is not None:
        _report(name, record, setup.console, folder)
    return done


def _report(name: str, record: Record, console: Console, folder: ResultsFolder) -> None:
    """Print the tables of a part and write them and its figure."""
    from studies.speed.setup import part

    module = part(name)
    text = "\n\n".join(str(table) for table in module.tables(record))
    console.say(f"\n{text}")
    folder.file(f"{name}.txt").write_text(f"{text}\n", "utf-8")
    figure = module.draw(record)
    if figure is not None:
        figure.savefig(folder.file(f"{name}.png"))
