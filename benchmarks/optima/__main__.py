"""`python -m benchmarks.optima`: problems with known optima, solved with default settings."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.entry import answer_for
from benchmarks.optima.benchmark import Benchmark
from benchmarks.optima.measure import POINTS, Measurement, measure
from benchmarks.optima.problems import CATALOGUE
from ocp import Accuracy, Interrupted
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
    parser.add_argument("--tag", metavar="TAG", help="only those so tagged, e.g. 'free time'")
    parser.add_argument("--list", action="store_true", help="list them with their sources")
    parser.add_argument("--output", type=Path, metavar="FILE.json", help="where numbers are kept")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    return answer_for(build_parser(), run, arguments)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Solve, print the table, write the record."""
    chosen = select(options.names, options.tag)
    if options.list:
        console.say(_contents(chosen))
        return ExitCode.OK

    found = _measure_all(chosen, console)
    console.say(_table(found))
    for one in found:
        if not one.passed:
            console.say(f"\n{one.name}: {_why(one)}")
        for doubt in one.doubts:
            console.say(f"\n{one.name}, certificate: {doubt}")
    passed = sum(one.passed for one in found)
    console.say(f"\n{passed} of {len(chosen)} passed")

    if options.output is not None:
        _write(options.output, found)
    if len(found) < len(chosen):
        return ExitCode.INTERRUPTED
    return ExitCode.OK if passed == len(chosen) else ExitCode.NOT_VERIFIED


def select(names: Sequence[str], tag: str | None = None) -> list[Benchmark]:
    """The benchmarks of the given names (all if there are none) that carry the tag.

    Raises
    ------
    StudyError
        If a name or tag is unknown, or no problem is left.
    """
    for name in names:
        if name not in CATALOGUE:
            raise StudyError(
                f"there is no benchmark {quoted(name)}; the names are {', '.join(CATALOGUE)}"
            )
    made = [CATALOGUE[name]() for name in (names or CATALOGUE)]
    chosen = [benchmark for benchmark in made if tag is None or tag in benchmark.tags]
    if not chosen:
        tags = sorted({tag for benchmark in made for tag in benchmark.tags})
        raise StudyError(
            f"none of these benchmarks is tagged {quoted(tag)}; tags: {', '.join(tags)}"
        )
    return chosen


def _measure_all(chosen: Sequence[Benchmark], console: Console) -> list[Measurement]:
    """Measure one after the other; an interruption leaves the rest out."""
    found: list[Measurement] = []
    for benchmark in chosen:
        try:
            measurement = measure(benchmark, progress=console.live)
        except (Interrupted, KeyboardInterrupt):
            console.complain(f"{benchmark.name} interrupted; what was measured is printed")
            break
        word = outcome(measurement.passed)
        console.progress(f"{benchmark.name} {word}, {measurement.seconds:.1f} s")
        found.append(measurement)
    return found


def _write(file: Path, found: Sequence[Measurement]) -> None:
    """Write all numbers as JSON.

    Raises
    ------
    StudyError
        If the file cannot be written.
    """
    try:
        file.write_text(json.dumps([one.as_record() for one in found], indent=1) + "\n", "utf-8")
    except OSError as error:
        raise StudyError(
            f"the file {file} cannot be written ({error.strerror}); name another one with --output"
        ) from error


def _contents(chosen: Sequence[Benchmark]) -> Table:
    return Table(
        title="Benchmarks",
        head=("problem", "optimum", "tolerance", "tags and source"),
        rows=[
            (b.name, f"{b.optimum:.12g}", f"{b.tolerance:.0e}", f"{', '.join(b.tags)}: {b.source}")
            for b in chosen
        ],
    )


def _table(found: Sequence[Measurement]) -> Table:
    return Table(
        title="Benchmarks, default settings, from their stated guesses",
        head=(
            "problem",
            "value",
            "error",
            "tolerance",
            "",
            "verdict",
            "certificate",
            "intervals",
            "rounds",
            "iterations",
            "seconds",
            "replay miss",
            "violation",
        ),
        rows=[_row(measurement) for measurement in found],
        notes=(
            "error: of the value, relative to the trusted optimum.",
            "certificate: how many of its checks of motion and first-order conditions hold.",
            "replay miss: of the end state when another integrator repeats the motion, relative.",
            f"violation: the largest of any bound at {POINTS} times of each phase, relative, of "
            f"solution and replay; {Accuracy().path:.0e} is allowed.",
        ),
    )


def _row(found: Measurement) -> tuple[str, ...]:
    return (
        found.name,
        number(found.value, 12),
        _signed(found.error),
        f"{found.tolerance:.0e}",
        "pass" if found.passed else "FAIL",
        found.verdict.split(":")[0],
        "-" if found.checks is None else f"{found.checks - len(found.doubts)} of {found.checks}",
        *("-" if n is None else str(n) for n in (found.intervals, found.rounds, found.iterations)),
        f"{found.seconds:.1f}",
        number(found.miss, 2),
        number(found.violation, 2),
    )


def _signed(error: float | None) -> str:
    return "-" if error is None else f"{error:+.1e}"


def _why(found: Measurement) -> str:
    """Why a benchmark failed: not verified, or verified and wrong."""
    if found.verdict.startswith(("local", "global")):
        return (
            f"verified, but the error is {_signed(found.error)} (tolerance "
            f"{found.tolerance:.0e}) and the violation {number(found.violation, 2)}"
        )
    return found.verdict


if __name__ == "__main__":
    sys.exit(main())
