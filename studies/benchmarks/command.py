"""`antenna-ocp benchmarks`: problems with known optima, solved and measured."""

from __future__ import annotations

import argparse
import math
import warnings
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from studies.common.console import Console, Table, number
from studies.common.exit_codes import ExitCode, StudyError, quoted
from studies.common.running import add_results_flags

if TYPE_CHECKING:
    from ocp import Trial
    from studies.benchmarks.benchmark import Benchmark
    from studies.benchmarks.measure import Measurement
    from studies.common.folder import ResultsFolder
    from studies.common.result import Result


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument("names", nargs="*", metavar="NAME", help="problems to solve; all if none")
    parser.add_argument("--tag", metavar="TAG", help="only those so tagged, e.g. 'free time'")
    parser.add_argument("--list", action="store_true", help="list them with their sources")
    parser.add_argument(
        "--starts",
        type=_starts,
        metavar="K",
        help="audit instead: solve each from K starts, the stated guess and random ones, and list "
        "the distinct optima found",
    )
    parser.add_argument(
        "--warm",
        action="store_true",
        help="count iterations instead: one number of each problem 5 %% higher, solved cold and "
        "from the solution",
    )
    add_results_flags(parser, figures=False)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Solve, print the table, write the record."""
    chosen = select(options.names, options.tag)
    if options.list:
        console.say(_contents(chosen))
        return ExitCode.OK
    code = _answered(chosen, options, console)
    if code is ExitCode.INTERRUPTED:
        console.complain("interrupted; what was measured until then is printed")
    return code


def _answered(
    chosen: Sequence[Benchmark], options: argparse.Namespace, console: Console
) -> ExitCode:
    """Do what the flags ask of the chosen problems."""
    if options.starts is not None:
        return _audit_all(chosen, options.starts, console)
    if options.warm:
        return _warm_all(chosen, console)

    folder = None
    if options.results is not None:
        from studies.common.folder import open_results

        # opened before the work, so that a folder that cannot be written costs nothing
        folder = open_results(options.results, "benchmarks", options.overwrite)
    return _measured(chosen, folder, console)


def _measured(
    chosen: Sequence[Benchmark], folder: ResultsFolder | None, console: Console
) -> ExitCode:
    """Measure, print the table, and keep it if there is a folder."""
    from studies.common.writers import exit_code

    measurements = _measure_all(chosen, console)
    console.say(_table(measurements))
    for measurement in measurements:
        if not measurement.passed:
            console.say(f"\n{measurement.name}: {_why(measurement)}")
        for doubt in measurement.doubts:
            console.say(f"\n{measurement.name}, certificate: {doubt}")

    result = result_of(chosen, measurements)
    if folder is not None:
        folder.write_json("benchmarks.json", result.details)
        folder.file("table.txt").write_text(f"{_table(measurements)}\n", "utf-8")
        result.save(folder.path)
        folder.complete()
        console.say(f"\neverything is in {folder.path}")
    console.say(f"\n{result.verdict.sentence}")
    return exit_code(result)


def result_of(chosen: Sequence[Benchmark], measurements: Sequence[Measurement]) -> Result:
    """The result of the measurements of chosen problems, which an interruption leaves out."""
    from studies.common.comparison_table import TableRow
    from studies.common.folder import provenance
    from studies.common.result import Criterion, Result, Verdict

    table = tuple(
        TableRow(m.name, m.name, "1", {"value": _or_nan(m.value), "trusted optimum": m.optimum})
        for m in measurements
    )
    checks = tuple(
        Criterion(f"{m.name}, error", "1", abs(_or_nan(m.error)), m.tolerance, m.passed)
        for m in measurements
    )
    passed = sum(m.passed for m in measurements)
    return Result(
        kind="benchmarks",
        question="Do default settings find the trusted optima from the stated guesses?",
        configuration={"names": [benchmark.name for benchmark in chosen]},
        table=table,
        verdict=Verdict("measured", f"{passed} of {len(chosen)} passed"),
        checks=checks,
        details={"results": [m.as_record() for m in measurements]},
        provenance=provenance(),
        interrupted=len(measurements) < len(chosen),
    )


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def select(names: Sequence[str], tag: str | None = None) -> list[Benchmark]:
    """The benchmarks of the given names (all if there are none) that carry the tag.

    Raises
    ------
    StudyError
        If a name or tag is unknown, or no problem is left.
    """
    from studies.benchmarks.problems import CATALOGUE

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
    from ocp import Interrupted
    from studies.benchmarks.measure import measure
    from studies.common.result import outcome

    found: list[Measurement] = []
    for benchmark in chosen:
        try:
            measurement = measure(benchmark, progress=console.live)
        except (Interrupted, KeyboardInterrupt):
            console.progress(f"{benchmark.name} interrupted")
            break
        word = outcome(measurement.passed)
        console.progress(f"{benchmark.name} {word}, {measurement.seconds:.1f} s")
        found.append(measurement)
    return found


def _starts(text: str) -> int:
    from studies.common.configuration import as_number, whole

    return int(whole(1)("--starts", as_number(text)))


def _audit_all(chosen: Sequence[Benchmark], starts: int, console: Console) -> ExitCode:
    """Print which optima `starts` starts find; NOT_VERIFIED if the best one is not the trusted."""
    from ocp import Interrupted, OcpError, StatementWarning, audit

    missed = False
    warnings.filterwarnings("ignore", category=StatementWarning)  # as in `measure`
    for benchmark in chosen:
        try:
            found = audit(
                benchmark.problem,
                starts=starts,
                progress=console.live,
                finished=partial(_say_trial, console, benchmark.name),
            )
        except Interrupted:
            return ExitCode.INTERRUPTED
        except OcpError as error:
            console.say(f"{benchmark.name}: {type(error).__name__}: {error}")
            missed = True
            continue
        wrong = benchmark.error(found.best.objective)
        console.say(f"{found}\n  the trusted optimum is {benchmark.optimum:.10g}: {wrong:+.1e}")
        missed |= abs(wrong) > benchmark.tolerance
        if found.interrupted:
            return ExitCode.INTERRUPTED
    return ExitCode.NOT_VERIFIED if missed else ExitCode.OK


def _say_trial(console: Console, name: str, trial: Trial) -> None:
    console.progress(f"{name}: {trial!r}")


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
    from ocp import Accuracy
    from studies.benchmarks.measure import POINTS

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
