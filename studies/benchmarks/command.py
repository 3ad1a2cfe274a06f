"""`antenna-ocp benchmarks`: problems with known optima, solved and measured."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from studies.common.console import Console, Table, number
from studies.common.exit_codes import ExitCode, StudyError

if TYPE_CHECKING:
    from studies.benchmarks.benchmark import Benchmark
    from studies.benchmarks.measure import Measurement
    from studies.common.folder import ResultsFolder


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument("names", nargs="*", metavar="NAME", help="problems to solve; all if none")
    parser.add_argument("--tag", metavar="TAG", help="only those so tagged, e.g. 'free time'")
    parser.add_argument("--list", action="store_true", help="list them with their sources")
    parser.add_argument(
        "--output", "--results", type=Path, metavar="DIR", help="a new folder, for table and JSON"
    )
    parser.add_argument(
        "--starts", type=_positive, metavar="K", help="audit instead: solve each from K starts, "
        "the stated guess and random ones, and list the distinct optima found",
    )  # fmt: skip
    parser.add_argument(
        "--warm", action="store_true", help="count iterations instead: one number of each problem "
        "5 %% higher, solved cold and from the solution",
    )  # fmt: skip
    parser.add_argument("--overwrite", action="store_true", help="replace the results folder")


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Solve, print the table, write the record."""
    chosen = select(options.names, options.tag)
    if options.list:
        console.say(_contents(chosen))
        return ExitCode.OK
    if options.starts is not None:
        return _audit_all(chosen, options.starts, console)
    if options.warm:
        return _warm_all(chosen, console)
    folder = None
    if options.output is not None:
        from studies.common.folder import open_results

        folder = open_results(options.output, "benchmarks", options.overwrite)
    found = _measure_all(chosen, console)
    interrupted = len(found) < len(chosen)
    console.say(_table(found))
    for measurement in found:
        if not measurement.passed:
            console.say(f"\n{measurement.name}: {_why(measurement)}")
        for doubt in measurement.doubts:
            console.say(f"\n{measurement.name}, certificate: {doubt}")
    if folder is not None:
        _write(folder, found)
        console.say(f"\neverything is in {folder.path}")
    failed = sum(not measurement.passed for measurement in found)
    console.say(f"\n{len(found) - failed} of {len(chosen)} passed")
    if interrupted:
        return ExitCode.INTERRUPTED
    return ExitCode.NOT_VERIFIED if failed else ExitCode.OK


def select(names: Sequence[str], tag: str | None = None) -> list[Benchmark]:
    """The benchmarks of the given names (all if there are none) that carry the tag.

    Raises
    ------
    StudyError
        If a name or tag is unknown, or no problem is left.
    """
    from studies.benchmarks.catalogue import CATALOGUE

    for name in names:
        if name not in CATALOGUE:
            raise StudyError(
                f"there is no benchmark {name!r}; the names are {', '.join(CATALOGUE)}"
            )
    made = [CATALOGUE[name]() for name in (names or CATALOGUE)]
    chosen = [benchmark for benchmark in made if tag is None or tag in benchmark.tags]
    if not chosen:
        tags = sorted({tag for benchmark in made for tag in benchmark.tags})
        raise StudyError(f"none of these benchmarks is tagged {tag!r}; tags: {', '.join(tags)}")
    return chosen


def _measure_all(chosen: Sequence[Benchmark], console: Console) -> list[Measurement]:
    """Measure one after the other; an interruption leaves the rest out."""
    from ocp import Interrupted
    from studies.benchmarks.measure import measure

    found: list[Measurement] = []
    for benchmark in chosen:
        try:
            measurement = measure(benchmark, progress=console.live)
        except (Interrupted, KeyboardInterrupt):
            console.progress(f"{benchmark.name} interrupted")
            break
        word = "passed" if measurement.passed else "FAILED"
        console.progress(f"{benchmark.name} {word}, {measurement.seconds:.1f} s")
        found.append(measurement)
    return found


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{value} starts find nothing; give at least 1")
    return value


def _audit_all(chosen: Sequence[Benchmark], starts: int, console: Console) -> ExitCode:
    """Print which optima `starts` starts find; NOT_VERIFIED if the best one is not the trusted."""
    from ocp import Interrupted, OcpError, StatementWarning, audit

    missed = False
    warnings.filterwarnings("ignore", category=StatementWarning)  # as in `measure`
    for benchmark in chosen:
        try:
            found = audit(benchmark.problem, starts=starts, progress=console.progress)
        except Interrupted as error:
            console.complain(str(error))
            return ExitCode.INTERRUPTED
        except OcpError as error:
            console.say(f"{benchmark.name}: {type(error).__name__}: {error}")
            missed = True
            continue
        wrong = benchmark.error(found.best.objective)
        console.say(f"{found}\n  the trusted optimum is {benchmark.optimum:.10g}: {wrong:+.1e}")
        missed |= abs(wrong) > benchmark.tolerance
    return ExitCode.NOT_VERIFIED if missed else ExitCode.OK


def _warm_all(chosen: Sequence[Benchmark], console: Console) -> ExitCode:
    """Cold and warm solves of changed problems, one after the other."""
    from ocp import Interrupted
    from studies.benchmarks.warm import WarmStart, passed, table, warm_start

    found: list[WarmStart] = []
    for benchmark in chosen:
        try:
            found.append(warm_start(benchmark, console.live))
        except (Interrupted, KeyboardInterrupt):
            console.progress(f"{benchmark.name} interrupted")
            break
        console.progress(f"{benchmark.name}: {found[-1].cold} cold, {found[-1].warm} warm")
    console.say(table(found))
    for one in found:
        if one.failure:
            console.say(f"\n{one.name}: {one.failure}")
    if len(found) < len(chosen):
        return ExitCode.INTERRUPTED
    return ExitCode.OK if passed(found) else ExitCode.NOT_VERIFIED


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
    from ocp import Settings
    from studies.benchmarks.violation import POINTS

    return Table(
        title="Benchmarks, default settings, from their stated guesses",
        head=(
            "problem", "value", "error", "tolerance", "", "verdict", "certificate", "intervals",
            "rounds", "iterations", "seconds", "replay miss", "violation",
        ),
        rows=[_row(measurement) for measurement in found],
        notes=(
            "error: of the value, relative to the trusted optimum.",
            "certificate: how many of its checks of motion and first-order conditions hold.",
            "replay miss: of the end state when another integrator repeats the motion, relative.",
            f"violation: the largest of any bound at {POINTS} times of each phase, relative, of "
            f"solution and replay; {Settings().path_tolerance:.0e} is allowed.",
        ),
    )  # fmt: skip


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


def _write(folder: ResultsFolder, found: Sequence[Measurement]) -> None:
    folder.write_json("benchmarks.json", {"results": [m.as_record() for m in found]})
    folder.file("table.txt").write_text(f"{_table(found)}\n", "utf-8")
    folder.complete()
