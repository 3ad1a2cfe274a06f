"""`python -m benchmarks.shows NAME`: run the cases of a show that have no row yet; print tables."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.entry import answer_for, positive, whole
from benchmarks.processes import FreshProcess
from benchmarks.records import ROOT
from benchmarks.shows.show import SHOWS, Row, Show, show
from benchmarks.shows.store import RowStore, open_store
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError

PARENT = Path("results") / "shows"


def build_parser() -> argparse.ArgumentParser:
    """Return the flags of the command."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.shows",
        description="Runs seeded cases, each in a process of its own, and prints their table. "
        "Each row is kept as soon as it is known: run the same command again to go on, with a "
        "larger count to go further. A case that fails is a row with its reason.",
    )
    parser.add_argument("name", nargs="?", metavar="NAME", help="of the show; --list names them")
    parser.add_argument("--list", action="store_true", help="list the shows")
    parser.add_argument("--count", default="10", metavar="N", help="cases from the first [10]")
    parser.add_argument("--skip", default="0", metavar="N", help="leave out the first N [0]")
    parser.add_argument("--seed", default="0", metavar="S", help="of the cases' questions [0]")
    parser.add_argument("--limit", metavar="S", help="seconds that a case may last")
    parser.add_argument(
        "--results", type=Path, metavar="DIR", help="where rows are kept [results/shows/NAME-SEED]"
    )
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    return answer_for(build_parser(), run, arguments)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Run what is missing, and print all rows."""
    if options.list:
        console.say("\n".join(f"{name:16} {show(name).LINE}" for name in SHOWS))
        return ExitCode.OK

    if options.name is None:
        raise StudyError(f"name a show; the shows are {', '.join(SHOWS)}")
    module = show(options.name)
    count, seed = whole("--count", options.count), whole("--seed", options.seed, least=0)
    skipped = whole("--skip", options.skip, least=0)
    if skipped >= count:
        raise StudyError(
            f"--skip {skipped} leaves none of {count} cases; give less, or a larger --count"
        )
    limit = module.LIMIT if options.limit is None else positive("--limit", options.limit)
    folder = options.results or PARENT / f"{options.name}-{seed}"
    store = open_store(folder, options.name, seed)

    wanted, interrupted = range(skipped, count), False
    try:
        _run_missing(store, options.name, seed, wanted, limit, console)
    except KeyboardInterrupt:  # the rows until then are printed
        interrupted = True

    rows = [row for index, row in store.rows().items() if index in wanted]
    if rows:
        console.say("\n\n".join(str(table) for table in module.tables(rows)))
    console.say(f"\n{len(rows)} of {len(wanted)} rows are in {store.folder}")
    return ExitCode.INTERRUPTED if interrupted else ExitCode.OK


def _run_missing(
    store: RowStore, name: str, seed: int, wanted: range, limit: float, console: Console
) -> None:
    """Run the wanted cases that have no row, in order."""
    module, known = show(name), store.rows()
    for index in wanted:
        if index in known:
            continue
        row = _run_case(store, name, module, seed, index, limit)
        store.write(index, row)
        outcome = row["failure"] or "answered"
        console.progress(f"case {index + 1} of {wanted.stop}: {outcome}, {row['seconds']:.1f} s")


def _run_case(store: RowStore, name: str, module: Show, seed: int, index: int, limit: float) -> Row:
    """The row of one case; a crash, or the limit, is a row with its reason."""
    command = (sys.executable, "-m", "benchmarks.shows.case", name, str(seed), str(index))
    process = FreshProcess(command, {"PYTHONPATH": str(ROOT)})
    answered = process.run(store.case_folder(index).resolve(), limit=limit)
    return {
        "index": index,
        **module.question(seed, index),
        **(answered.answer or {}),
        "seconds": answered.seconds,
        "failure": answered.failure,
    }


if __name__ == "__main__":
    sys.exit(main())
