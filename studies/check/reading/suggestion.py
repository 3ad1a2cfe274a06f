"""The command that reads a table whose columns have names of their own, filled in with these.

Which column is meant is told by its unit and its numbers: times rise evenly, an opening rises. The
user sees the guess, and runs it or mends it.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence

import numpy as np

from ocp.arrays import Array
from studies.check.reading.headers import DIMENSIONS, UNITS, Column, unit_of
from studies.check.reading.raw_table import RawTable, listed
from studies.common.exit_codes import StudyError

PERIOD = "0.01 s"  # from row to row, if nothing states another one
OPENED = 4.0  # no angle of ours is as large in rad, so that larger ones are degrees
# a recording of less than an hour tells the unit of its times
SPANS = ((3.6e3, "s"), (3.6e6, "ms"), (3.6e9, "us"), (float("inf"), "ns"))


def columns_named(table: RawTable, columns: Sequence[Column], **units: str) -> str:
    """The lines below a refusal: the command that reads the table, and the columns there are.

    Parameters
    ----------
    columns : that are understood already.
    units : by quantity, in place of those that are stated.
    """
    known = {column.quantity: column for column in reversed(columns)}
    words = [
        f"{quantity}={_text(table, column.place)}:{units.get(quantity) or column.unit or si}"
        for quantity, column in known.items()
        if (si := next(iter(UNITS[DIMENSIONS[quantity]])))
    ]
    numbers = _numbers(table, {column.place for column in columns})
    if "time" not in known:
        place = _of_times(table, numbers)
        words.insert(0, _guess(table, "time", place, numbers, DIMENSIONS["time"]))
        numbers.pop(place, None)
    if not known.keys() - {"time"} and numbers:
        place = _of_an_opening(table, numbers)
        words.append(_guess(table, "angle", place, numbers, "angle"))
    flags = " ".join(f"--column {shlex.quote(word)}" for word in words)
    return (
        f"\n  antenna-ocp check {shlex.quote(str(table.path))} {flags}\n"
        f"its columns are {listed(table.headers)}"
    )


def _numbers(table: RawTable, taken: set[int]) -> dict[int, Array]:
    """The columns of numbers that are left, without what is empty."""
    found = {}
    for place in range(len(table.headers)) if table.columns is None else table.columns:
        try:
            (array,) = table.column((place,))
        except StudyError:  # texts
            continue
        array = array[np.isfinite(array)]
        if place not in taken and array.size > 1 and np.ptp(array) > 0:
            found[place] = array
    return found


def _of_times(table: RawTable, numbers: Mapping[int, Array]) -> int | None:
    """The column whose numbers rise most evenly; None if none rises but the number of the row."""
    by_unit = [k for k in numbers if unit_of(table.headers[k]) in UNITS["time"]]
    rising = {}
    for place, array in numbers.items():
        step = np.diff(array)
        counts_rows = bool((step == 1.0).all()) and array[0] in (0.0, 1.0)
        if step.min() > 0 and not counts_rows:
            rising[place] = float(np.ptp(step) / step.mean())
    if by_unit:
        return by_unit[0]
    return min(rising, key=lambda place: rising[place], default=None)


def _of_an_opening(table: RawTable, numbers: Mapping[int, Array]) -> int:
    """The column with a unit of an angle, else that which rises most of its range."""
    by_unit = [k for k in numbers if unit_of(table.headers[k]) in UNITS["angle"]]

    def rise(place: int) -> float:
        array = numbers[place]
        whole = bool((np.diff(array) == 1.0).all())  # the number of the row
        return -1.0 if whole else round(float((array[-1] - array[0]) / np.ptp(array)), 1)

    return by_unit[0] if by_unit else max(numbers, key=rise)


def _guess(
    table: RawTable,
    quantity: str,
    place: int | None,
    numbers: Mapping[int, Array],
    dimension: str,
) -> str:
    if place is None:
        return f"{quantity}=row:{table.period or PERIOD}"
    unit = unit_of(table.headers[place])
    if unit not in UNITS[dimension]:
        array = numbers[place]
        if dimension == "time":
            unit = next(unit for most, unit in SPANS if np.ptp(array) <= most)
        else:
            unit = "rad" if np.abs(array).max() <= OPENED else "deg"
    return f"{quantity}={_text(table, place)}:{unit}"


def _text(table: RawTable, place: int) -> str:
    """How a column is named: by its header, or its number if others have that too."""
    header = table.headers[place]
    plain = bool(header) and header.isprintable() and table.headers.count(header) == 1
    return header if plain and not header.startswith("column ") else str(place + 1)
