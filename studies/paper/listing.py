"""The rows as text for the terminal, as CSV, and as tables for the documents."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from studies.common.console import Table, number
from studies.common.result import Result
from studies.paper.entries import WRITTEN, Entry, PaperVerdict

HEAD = ("place", "quantity", "unit", "printed", "ours", "difference", "verdict")
TITLE = "Lu, Qi, Hu, Li, Zhang, IEEE Access 2019, DOI 10.1109/ACCESS.2019.2918614"


def entries_from(result: Result) -> list[Entry]:
    """The rows of a result, which may have been stored."""
    return [entry_from(record) for record in result.details["entries"]]


def entry_from(record: Mapping[str, Any]) -> Entry:
    """A row out of JSON, which has no number where there was none."""
    fields = {name: value for name, value in record.items() if name != "key"}
    ours = fields["ours"]
    fields["ours"] = float("nan") if ours is None else float(ours)
    return Entry(**{**fields, "verdict": PaperVerdict(fields["verdict"])})


def cells(entry: Entry) -> tuple[str, ...]:
    """The cells of a row, in the order of `HEAD`."""
    if entry.printed == WRITTEN:
        shown = "agrees" if entry.holds else "differs"
        return (*_what(entry), WRITTEN, shown, entry.difference_text, entry.verdict_text)
    printed = entry.printed or "-"
    return (
        *_what(entry),
        printed,
        number(entry.ours, 6),
        entry.difference_text,
        entry.verdict_text,
    )


def _what(entry: Entry) -> tuple[str, str, str]:
    return entry.place, entry.quantity, entry.unit


def outcome_text(result: Result) -> str:
    """What the command prints: every row, what differs and why, and how many have which verdict."""
    entries = entries_from(result)
    notes = (
        "printed: as in the paper, or what follows from it; '-' where the paper prints no number.",
        "formula: written as printed and compared with the models; the difference is relative.",
    )
    width = max(len(entry.place) for entry in entries)
    rows = [(f"{place:<{width}}  {what}", *rest) for place, what, *rest in map(cells, entries)]
    table = Table(TITLE, ("place and quantity", *HEAD[2:]), rows, notes)
    counts = result.details["counts"]
    lines = [f"{len(entries)} rows:"]
    lines += [f"  {counts[verdict.value]:>3}  {verdict.value}" for verdict in PaperVerdict]
    failed = [entry for entry in entries if not entry.holds]
    lines += [f"NOT FOUND: {entry.place} {entry.quantity}: {entry.reason}" for entry in failed]
    reasons = [
        "\n".join([title, *(f"  {e.place} {e.quantity}: {e.reason}" for e in of(entries, verdict))])
        for title, verdict in (
            ("misprints and slips:", PaperVerdict.MISPRINT),
            ("not reproduced by our models:", PaperVerdict.NOT_SHARED),
        )
    ]
    return "\n\n".join([str(table), *reasons, "\n".join(lines)])


def of(entries: Iterable[Entry], verdict: PaperVerdict) -> list[Entry]:
    """The rows with a verdict."""
    return [entry for entry in entries if entry.verdict is verdict]


def files(result: Result) -> dict[str, str]:
    """The rows as a further file of a results folder."""
    return {"rows.csv": rows_csv(result)}


def rows_csv(result: Result) -> str:
    """All rows with their reasons as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(("key", *HEAD, "reason"))
    for record, entry in zip(result.details["entries"], entries_from(result), strict=True):
        ours = "" if entry.ours != entry.ours else repr(entry.ours)
        shown = cells(entry)
        writer.writerow((record["key"], *shown[:4], ours, *shown[5:], entry.reason))
    return text.getvalue()


def difference_rows(entries: Sequence[Entry], verdict: PaperVerdict) -> list[tuple[str, ...]]:
    """Place, what, printed, ours and why of each row with a verdict."""
    return [
        (
            entry.place,
            f"{entry.quantity} [{entry.unit}]",
            entry.printed or "-",
            number(entry.ours, 4),
            entry.reason,
        )
        for entry in of(entries, verdict)
    ]


def assumption_rows(entries: Sequence[Entry]) -> list[tuple[str, ...]]:
    """Place, what, our choice and why of what the paper leaves open."""
    return [
        (entry.place, f"{entry.quantity} [{entry.unit}]", number(entry.ours, 6), entry.reason)
        for entry in of(entries, PaperVerdict.ASSUMPTION)
    ]
