"""Records of today held against those of an earlier commit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from benchmarks.records import TOTALS, Record
from studies.common.console import Table, number

MORE_ITERATIONS = 0.05  # part of the total that a change of the code may cost


@dataclass(frozen=True)
class RecordComparison:
    """Two records of each case that both sides have.

    Attributes
    ----------
    pairs : (before, after) of each case.
    missing : names of the cases that one side lacks.
    """

    pairs: tuple[tuple[Record, Record], ...]
    missing: tuple[str, ...]

    @property
    def iterations(self) -> tuple[int, int]:
        """Total iterations before and after."""
        before, after = (sum(pair[side].iterations for pair in self.pairs) for side in (0, 1))
        return before, after

    @property
    def complaints(self) -> tuple[str, ...]:
        """A sentence for each thing that became worse; none if the comparison passes."""
        found = [line for pair in self.pairs for line in _complaints(*pair)]
        before, after = self.iterations
        if after > before * (1 + MORE_ITERATIONS):
            found.append(
                f"the total of {after} iterations is {_percent(before, after)} above {before}; "
                f"{MORE_ITERATIONS:.0%} is allowed"
            )
        return tuple(found)


def compare(before: Mapping[str, Record], after: Mapping[str, Record]) -> RecordComparison:
    """The comparison of all cases that both sides have, in the order of `after`."""
    pairs = tuple((before[name], after[name]) for name in after if name in before)
    missing = tuple(sorted(before.keys() ^ after.keys()))
    return RecordComparison(pairs, missing)


def difference(before: Record, after: Record) -> float | None:
    """Relative difference of the values, signed; None where a value is missing."""
    if before.value is None or after.value is None:
        return None
    if before.value == after.value:
        return 0.0
    size = abs(before.value) or abs(after.value)
    return (after.value - before.value) / size


def _complaints(before: Record, after: Record) -> list[str]:
    """What became worse in one case."""
    if after.value is None:
        failed_anew = before.value is not None
        return [f"{after.name}: no answer any more: {after.failure}"] if failed_anew else []

    found = []
    change = difference(before, after)
    tolerance = max(before.tolerance, after.tolerance)
    if change is not None and not abs(change) <= tolerance:
        found.append(f"{after.name}: the value differs by {change:+.1e}, more than {tolerance:.0e}")

    # checks may be added: what counts is a new failure, or fewer that pass
    failed_anew_names = sorted(set(after.failed_checks) - set(before.failed_checks))
    if failed_anew_names:
        found.append(f"{after.name}: the certificate lost {', '.join(failed_anew_names)}")
    elif after.passed_checks < before.passed_checks:
        found.append(
            f"{after.name}: {after.passed_checks} checks pass, {before.passed_checks} before"
        )
    return found


def record_table(records: Mapping[str, Record]) -> Table:
    """Value, effort and certificate of each case."""
    everything = list(records.values())
    rows = [
        (
            record.name,
            number(record.value, 12),
            str(record.rounds),
            str(record.iterations),
            f"{record.seconds:.1f}",
            _certificate(record),
        )
        for record in everything
    ]

    totals = (
        TOTALS,
        "",
        str(sum(record.rounds for record in everything)),
        str(sum(record.iterations for record in everything)),
        f"{sum(record.seconds for record in everything):.1f}",
        "",
    )

    notes = [
        f"{r.name}, failed checks: {', '.join(r.failed_checks)}"
        for r in everything
        if r.failed_checks
    ]
    notes += [f"{r.name} has no answer: {r.failure}" for r in everything if r.failure]
    head = ("case", "value", "rounds", "iterations", "processor s", "certificate")
    return Table("Regression cases, default settings", head, [*rows, totals], notes)


def comparison_table(comparison: RecordComparison) -> Table:
    """Both sides of each case, before -> after."""
    rows = [
        (
            after.name,
            number(after.value, 12),
            _signed(difference(before, after)),
            f"{max(before.tolerance, after.tolerance):.0e}",
            f"{before.rounds} -> {after.rounds}",
            f"{before.iterations} -> {after.iterations}",
            f"{before.seconds:.1f} -> {after.seconds:.1f}",
            f"{_certificate(before)} -> {_certificate(after)}",
        )
        for before, after in comparison.pairs
    ]

    # sums of the cases that both sides have
    sides = [[pair[side] for pair in comparison.pairs] for side in (0, 1)]
    rounds = [sum(record.rounds for record in side) for side in sides]
    seconds = [sum(record.seconds for record in side) for side in sides]
    before, after = comparison.iterations
    totals = (
        TOTALS,
        "",
        "",
        "",
        f"{rounds[0]} -> {rounds[1]}",
        f"{before} -> {after} ({_percent(before, after)})",
        f"{seconds[0]:.1f} -> {seconds[1]:.1f}",
        "",
    )

    head = (
        "case",
        "value",
        "difference",
        "tolerance",
        "rounds",
        "iterations",
        "processor s",
        "certificate",
    )
    notes = ["difference: of the value, relative to the value before."]
    if comparison.missing:
        notes.append(f"not compared, on one side only: {', '.join(comparison.missing)}.")
    return Table("Before -> after", head, [*rows, totals], notes)


def _certificate(record: Record) -> str:
    return f"{record.passed_checks} of {record.checks}" if record.checks else "-"


def _signed(value: float | None) -> str:
    return "-" if value is None else "same" if value == 0 else f"{value:+.1e}"


def _percent(before: int, after: int) -> str:
    return f"{100 * (after / before - 1):+.1f} %" if before else "-"
