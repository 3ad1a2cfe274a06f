"""`python -m benchmarks.shows NAME`: run the cases of a show that have no row yet; print tables."""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.entry import answer_for, positive, whole
from benchmarks.processes import FreshProcess
from benchmarks.records import ROOT, provenance
from benchmarks.shows.show import SHOWS, Row, Show, show
from studies.common.code_version import SCHEMA, CodeVersion, hashed
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.sweep.cases.store import CaseStore, DamagedCase

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
    cases = SeededCases(options.name, module, seed, limit, CaseStore(folder, _version()))
    cases.store.open()

    rows, interrupted = cases.rows(range(count)), False
    try:
        for index in (index for index in range(skipped, count) if index not in rows):
            row = rows[index] = cases.run(index)
            outcome = row["failure"] or "answered"
            console.progress(f"case {index + 1} of {count}: {outcome}, {row['seconds']:.1f} s")
    except KeyboardInterrupt:  # the rows until then are printed
        interrupted = True

    wanted = [rows[index] for index in range(skipped, count) if index in rows]
    if wanted:
        console.say("\n\n".join(str(table) for table in module.tables(wanted)))
    console.say(f"\n{len(wanted)} of {count - skipped} rows are in {folder}")
    for words, other in cases.store.others().items():
        console.say(f"{other} rows of {words} are there too, and left out")
    return ExitCode.INTERRUPTED if interrupted else ExitCode.OK


def _version() -> CodeVersion:
    """The state of all packages that are measured: shows call commands of any of them."""
    made = provenance()
    return CodeVersion(SCHEMA, made["commit"], made["casadi"], hashed(made))


@dataclass(frozen=True)
class SeededCases:
    """The cases of a show and a seed; their rows are files of the store of sweeps.

    Attributes
    ----------
    name, module, seed : of the show.
    limit : that a case may last [s].
    store : of the rows that this state of the code has answered.
    """

    name: str
    module: Show
    seed: int
    limit: float
    store: CaseStore

    def rows(self, wanted: range) -> dict[int, Row]:
        """Return the rows that are there; a damaged one is none."""
        found: dict[int, Row] = {}
        for index in wanted:
            with contextlib.suppress(DamagedCase):
                found[index] = self.store.read(self._key(index))
        return found

    def run(self, index: int) -> Row:
        """Answer a case and keep its row; a crash, or the limit, is a row with its reason."""
        words = ("-m", "benchmarks.shows.case", self.name, str(self.seed), str(index))
        process = FreshProcess((sys.executable, *words), {"PYTHONPATH": str(ROOT)})
        folder = self.store.folder / "kept" / self._key(index)
        folder.mkdir(parents=True, exist_ok=True)
        answered = process.run(folder.resolve(), limit=self.limit)
        self.store.write(
            {
                "key": self._key(index),
                "index": index,
                **self.module.question(self.seed, index),
                **(answered.answer or {}),
                "seconds": answered.seconds,
                "failure": answered.failure,
            }
        )
        return self.store.read(self._key(index))

    def _key(self, index: int) -> str:
        return f"{self.name}-{self.seed}-{index:06}"


if __name__ == "__main__":
    sys.exit(main())
