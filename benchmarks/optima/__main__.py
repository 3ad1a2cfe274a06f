"""`python -m benchmarks.optima`: problems with known optima, solved with default settings."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence

from benchmarks.entry import answer_for
from benchmarks.optima.benchmark import Benchmark
from benchmarks.optima.catalogue import CATALOGUE
from benchmarks.optima.checks import OWN_CHECKS
from benchmarks.records import Record
from benchmarks.regression import solved_apart
from studies.common.configuration import closest
from studies.common.console import Console, Table, number
from studies.common.exit_codes import ExitCode, StudyError, quoted
from studies.common.result import outcome


def build_parser() -> argparse.ArgumentParser:
    """Return the flags of the command."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.optima",
        description="Solves problems of the literature from their stated guesses, all with the "
        "same default settings, and compares the answers with trusted optima. The exit code is 0 "
        "only if all pass.",
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="problems to solve; all if none")
    parser.add_argument("--list", action="store_true", help="list them with their sources")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    return answer_for(build_parser(), run, arguments)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Solve each in a process of its own, and print the table."""
    chosen = select(options.names)
    if options.list:
        console.say(_contents(chosen))
        return ExitCode.OK

    records: dict[str, Record] = {}
    try:
        for benchmark in chosen:
            record = records[benchmark.name] = solved_apart(benchmark.name)
            word = outcome(passes(record))
            console.progress(f"{benchmark.name} {word}, {record.seconds:.1f} s")
    except KeyboardInterrupt:
        console.complain("interrupted; what was solved until then is printed")

    console.say(_table(records, chosen))
    passed = sum(passes(record) for record in records.values())
    console.say(f"\n{passed} of {len(chosen)} passed")
    if len(records) < len(chosen):
        return ExitCode.INTERRUPTED
    return ExitCode.OK if passed == len(chosen) else ExitCode.NOT_VERIFIED


def passes(record: Record) -> bool:
    """Whether there is an answer whose optimum, limits and verification are right."""
    return record.value is not None and not set(OWN_CHECKS) & set(record.failed_checks)


def select(names: Sequence[str]) -> list[Benchmark]:
    """The benchmarks of the given names, all if there are none.

    Raises
    ------
    StudyError
        If a name is unknown.
    """
    for name in names:
        if name not in CATALOGUE:
            raise StudyError(f"there is no benchmark {quoted(name)}; {closest(name, CATALOGUE)}")
    return [CATALOGUE[name]() for name in (names or CATALOGUE)]


def _contents(chosen: Sequence[Benchmark]) -> Table:
    return Table(
        "Benchmarks",
        ("problem", "optimum", "tolerance", "source"),
        [(b.name, f"{b.optimum:.12g}", f"{b.tolerance:.0e}", b.source) for b in chosen],
    )


def _table(records: Mapping[str, Record], chosen: Sequence[Benchmark]) -> Table:
    """Value and effort of each problem, and the names of the checks that failed."""
    rows = []
    for benchmark in chosen:
        if (record := records.get(benchmark.name)) is None:  # interrupted before
            continue

        error = None if record.value is None else benchmark.error(record.value)
        rows.append(
            (
                record.name,
                number(record.value, 12),
                "-" if error is None else f"{error:+.1e}",
                f"{benchmark.tolerance:.0e}",
                f"{record.passed_checks} of {record.checks}",
                str(record.rounds),
                str(record.iterations),
                f"{record.seconds:.1f}",
                record.failure or ", ".join(record.failed_checks) or outcome(True),
            )
        )

    head = ("problem", "value", "error", "tolerance", "checks", "rounds", "iterations")
    return Table(
        "Benchmarks, default settings, from their stated guesses",
        (*head, "processor s", "failed checks"),
        rows,
        (
            "error: of the value, relative to the trusted optimum.",
            "checks: of the certificate, and those of the optimum and of the limits.",
        ),
    )


if __name__ == "__main__":
    sys.exit(main())
