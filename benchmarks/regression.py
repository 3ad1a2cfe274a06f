"""`python -m benchmarks.regression`: solve all cases, and hold them against earlier records.

The exit code is 0 if every case has an answer and the comparison, where one was asked for, found
nothing worse.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.cases import names
from benchmarks.comparison import compare, comparison_table, record_table
from benchmarks.entry import answer_for
from benchmarks.processes import FreshProcess
from benchmarks.records import (
    ROOT,
    Record,
    RecordError,
    RecordFile,
    provenance,
    read_records,
    record_from,
)
from studies.common.console import Console, number

# Iterations are compared, and how many a hard problem takes depends on the order of sums (725 and
# 1,318 of alp_rider). So all machines use the kernels with which the baseline was recorded, unless
# the environment names others.
CORE_TYPE, KERNELS = "OPENBLAS_CORETYPE", "Haswell"

LONGEST = 3600.0  # [s] that a case may last; the slowest takes half a minute


def main(arguments: Sequence[str] | None = None) -> int:
    """Carry out the command; return its exit code."""
    return answer_for(_parser(), _run, arguments)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.regression",
        description="Solves fifteen benchmarks, both problems of the race, both stages of the arm "
        "and five studies of the truss with default settings, and prints value, mesh iterations, "
        "iterations, processor seconds and certificate of each.",
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="cases to solve; all if none")
    parser.add_argument("--list", action="store_true", help="list the cases")
    parser.add_argument(
        "--output",
        type=Path,
        metavar="FILE.json",
        help="where records are kept as they come; cases that it holds are not solved again",
    )
    parser.add_argument("--fresh", action="store_true", help="begin the output file anew")
    parser.add_argument(
        "--against",
        type=Path,
        metavar="FILE.json",
        help="compare with these records; fail where an optimum changed, a certificate lost a "
        "check, or the iterations grew by more than 5 %%",
    )
    return parser


def _run(options: argparse.Namespace, console: Console) -> int:
    wanted = _wanted(options.names)
    if options.list:
        console.say("\n".join(wanted))
        return 0

    # read before the work: a mistyped name is said at once
    earlier = read_records(options.against) if options.against is not None else None
    kept = _opened(options.output, options.fresh)
    for place, name in enumerate(wanted, start=1):
        if name not in kept.records:
            kept = kept.with_record(solved_apart(name))
            if options.output is not None:
                kept.write(options.output)
            console.progress(f"{place} of {len(wanted)}: {_line(kept.records[name])}")

    records = {name: kept.records[name] for name in wanted}
    console.say(record_table(records))
    answered = all(record.value is not None for record in records.values())
    if earlier is None:
        return 0 if answered else 1

    # of a choice of cases, only these are compared
    before = {name: r for name, r in earlier.records.items() if name in wanted or not options.names}
    comparison = compare(before, records)
    console.say(f"\n{comparison_table(comparison)}\n")
    for complaint in comparison.complaints:
        console.say(complaint)
    if not comparison.complaints:
        console.say("nothing became worse")
    return 1 if comparison.complaints else 0


def _wanted(asked: Sequence[str]) -> tuple[str, ...]:
    """The cases asked for, all if none are named.

    Raises
    ------
    RecordError
        If there is no such case.
    """
    for name in asked:
        if name not in names():
            raise RecordError(f"there is no case {name!r}; the names are {', '.join(names())}")
    return tuple(asked) or names()


def _opened(output: Path | None, fresh: bool) -> RecordFile:
    """The records kept so far.

    Raises
    ------
    RecordError
        If the file belongs to another state of the code or cannot be written.
    """
    here = RecordFile(provenance(), {})
    if output is None:
        return here
    if fresh or not output.exists():
        try:
            here.write(output)
        except OSError as error:
            raise RecordError(f"the file {output} cannot be written ({error.strerror})") from error
        return here

    kept = read_records(output)
    if kept.made_by != here.made_by:
        raise RecordError(
            f"the file {output} holds records of commit {kept.made_by.get('commit', 'unknown')} or "
            f"of other libraries, but this is {here.made_by['commit']}; name another file or add "
            "--fresh"
        )
    return kept


def solved_apart(name: str) -> Record:
    """The record of a case, solved in a process of its own; a crash is a record too."""
    command = (sys.executable, "-m", "benchmarks.cases", name)
    environment = {"PYTHONPATH": str(ROOT), CORE_TYPE: os.environ.get(CORE_TYPE, KERNELS)}
    answered = FreshProcess(command, environment).run(limit=LONGEST)
    if answered.answer is None:
        return Record(name, None, 0.0, 0, 0, 0.0, failure=answered.failure)
    return record_from(answered.answer)


def _line(record: Record) -> str:
    if record.failure:
        return f"{record.name}: {record.failure}"
    return (
        f"{record.name}: {number(record.value, 9)}, {record.rounds} rounds, {record.iterations} "
        f"iterations, {record.seconds:.1f} s, {record.passed_checks} of {record.checks} checks"
    )


if __name__ == "__main__":
    sys.exit(main())
