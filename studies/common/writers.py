"""Any result as text and table, and its folder. All that a command prints of a run is from here."""

from __future__ import annotations

from studies.common.columns import flat, stored_columns, write_csv, write_json
from studies.common.comparison_table import OUTSTANDING, WORSE, Cost, TableRow
from studies.common.console import Table, number
from studies.common.exit_codes import ExitCode
from studies.common.folder import ResultsFolder
from studies.common.headers import comments
from studies.common.result import Result

CASES = "case"  # axis of a sweep, whose table is no profile of one motion


def exit_code(result: Result) -> ExitCode:
    """What the command that made a result ends with."""
    if result.interrupted:
        return ExitCode.INTERRUPTED
    if result.verdict.kind == "unattained":  # as good as any, and yet none is best
        return ExitCode.INFEASIBLE
    return ExitCode.OK if result.passed else ExitCode.NOT_VERIFIED


def table(result: Result) -> Table:
    """The table of a result; caps and bounds have columns where there are any."""
    laws, rows = result.laws, result.table
    capped = any(row.cap is not None for row in rows)
    bounded = any(row.bound is not None for row in rows)
    head = ["", *(f"{law}  " for law in laws)]
    head += ["cap"] * capped + ["bound"] * bounded

    cells = []
    for row in rows:
        mark = "* " if row.minimised else "  "
        line = [f"{mark}{row.title} [{row.unit}]", *(_cell(row, law) for law in laws)]
        line += [number(row.cap, 6)] * capped + [number(row.bound, 6)] * bounded
        cells.append(line)

    notes = []
    if any(row.minimised for row in rows):
        bound = (
            "  bound: proven lower bound of each row; no single motion need reach all bounds."
            if bounded
            else ""
        )
        notes.append(f"* minimised.{bound}")
    if any(row.broken_by for row in rows):
        notes.append("! exceeds a cap, so this law is not used for comparison.")
    return Table(title=result.question, head=head, rows=cells, notes=notes)


def _cell(row: TableRow, law: str) -> str:
    # the mark has a place of its own, so that the digits stand in a column
    return number(row.values.get(law), 6) + (" !" if law in row.broken_by else "  ")


def table_text(result: Result) -> str:
    """Table and verdict, as `table.txt` holds them."""
    return f"{table(result)}\n\n{result.verdict.sentence}\n"


def outcome_text(result: Result, every_check: bool = False) -> str:
    """What a command prints when a study has ended: the table and what to make of it.

    Parameters
    ----------
    every_check : bool
        Whether checks that passed have a line each, too.
    """
    paragraphs = [*_outstanding(result), str(table(result))]
    paragraphs.append("\n".join(_findings(result, with_checks=not every_check)))
    if every_check:
        paragraphs.append("\n".join(check.sentence for check in result.checks))
    return "\n\n".join(paragraphs)


def report_text(result: Result) -> str:
    """All of a result for a reader who was not there: question, findings, checks, provenance."""
    paragraphs = [f"question: {result.question}", *_outstanding(result)]
    if result.missing:
        paragraphs.append(f"incomplete, missing: {', '.join(result.missing)}")
    if result.table:
        paragraphs.append(str(table(result)))
    paragraphs.append("\n".join(_findings(result, with_checks=False)))
    if result.checks:
        paragraphs.append("\n".join(["checks:", *(f"  {c.sentence}" for c in result.checks)]))
    if result.provenance:
        paragraphs.append("\n".join(["provenance:", *comments(flat(result.provenance), "  ")]))
    return "\n\n".join(paragraphs)


def _outstanding(result: Result) -> list[str]:
    """Costs that nobody may overlook: they stand before the table."""
    found = [cost for cost in result.costs_elsewhere if cost.ratio > OUTSTANDING]
    return ["\n".join(f"ATTENTION: {cost.sentence}" for cost in found)] if found else []


def _findings(result: Result, with_checks: bool = True) -> list[str]:
    """Verdict, remarks, costs and, in one line if all passed, the checks."""
    lines = [f"verdict: {result.verdict.sentence}", *result.remarks, *_cost_lines(result)]
    if with_checks and result.checks:
        failed = [check.sentence for check in result.checks if not check.passed]
        decided = all(check.decided for check in result.checks)
        word = "verified" if decided and result.verdict.kind != "unverified" else "checks"
        lines += failed or [f"{word}: {_none_failed(result)}"]
    return lines


def _none_failed(result: Result) -> str:
    """What to say of checks none of which failed."""
    count, left = len(result.checks), sum(not check.decided for check in result.checks)
    return (
        f"all {count} checks passed" if not left else f"{count - left} passed, {left} not decided"
    )


def _cost_lines(result: Result) -> list[str]:
    """The costs, below a line that says what they are compared with."""

    def line(cost: Cost) -> str:
        return f"  {cost.sentence}"

    compared = any(row.better != "neither" for row in result.table)
    if not result.compared_with or not compared:
        return []
    more = f"{100 * (WORSE - 1):.0f} %"
    if not result.costs_elsewhere:
        return [f"costs elsewhere: none; no quantity is more than {more} above the better baseline"]
    head = f"costs elsewhere (more than {more} above the better baseline's):"
    return [head, *map(line, result.costs_elsewhere)]


def write(result: Result, folder: ResultsFolder) -> None:
    """Write a result, and beside it the files that people read."""
    folder.file("table.txt").write_text(table_text(result), "utf-8")
    if result.arrays and result.axis != CASES:
        columns = stored_columns(result)
        folder.file("profile.csv").write_text(write_csv(result, columns), "utf-8", newline="")
        folder.file("profile.json").write_text(write_json(result, columns), "utf-8")
    folder.write_json("verification.json", record(result))
    result.save(folder.path)


def record(result: Result) -> dict[str, object]:
    """The record of what was checked, by what, to what tolerance: `verification.json`."""
    own = next(iter(result.laws), "")
    return {
        "passed": result.passed,
        "verdict": result.verdict.sentence,
        "remarks": list(result.remarks),
        "study": result.configuration,
        "checks": result.as_dictionary()["checks"],
        "costs_elsewhere": result.as_dictionary()["costs_elsewhere"],
        **result.details,
        "bounds": result.bounds,
        "values": {row.key: row.values[own] for row in result.table},
        "made_by": result.provenance,
    }
