"""The command that reads a table whose columns have names of their own, filled in with these.

Which column is meant is told by its unit and its numbers: times rise evenly, an opening rises. The
user sees the guess, and runs it or mends it.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence

import numpy as np

from ocp.arrays import Array
from studies.check.reading.headers import DIMENSIONS, UNITS, Column, unit_of
from studies.check.reading.table import RawTable, listed
from studies.common.exit_codes import StudyError

PERIOD = "0.01 s"  # from row to row, if nothing states another one
OPENED = 4.0  # no angle of ours is as large in rad, so that larger ones are degrees
STANDSTILL = 0.01  # of the median step of times, below which they would stand still
EVEN = 0.5  # steps of times differ by less, those of a motion from rest by more
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
    numbers = _numbers(table)
    words = [
        f"{quantity}={_text(table, column.place)}:{units.get(quantity) or _unit(column, numbers)}"
        for quantity, column in known.items()
    ]
    for column in columns:
        numbers.pop(column.place, None)
    if "time" not in known:
        place = _of_times(table, numbers)
        words.insert(0, _guess(table, "time", place, numbers, DIMENSIONS["time"]))
        if place is not None:
            del numbers[place]
    if not known.keys() - {"time"} and numbers:
        place = _of_an_opening(table, numbers)
        words.append(_guess(table, "angle", place, numbers, "angle"))
    flags = " ".join(f"--column {shlex.quote(word)}" for word in words)
    return (
        f"\n  antenna-ocp check {shlex.quote(str(table.path))} {flags}\n"
        f"its columns are {listed(table.headers)}"
    )


def _unit(column: Column, numbers: Mapping[int, Array]) -> str:
    """The unit of a column that is understood, or that of its numbers."""
    return column.unit or _likely_unit(DIMENSIONS[column.quantity], numbers.get(column.place))


def _likely_unit(dimension: str, array: Array | None) -> str:
    """The unit in which numbers are as large as they are."""
    if array is not None and dimension == "time":
        return next(unit for most, unit in SPANS if np.ptp(array) <= most)
    if array is not None and dimension == "angle":
        return "rad" if np.abs(array).max() <= OPENED else "deg"
    return next(iter(UNITS[dimension]))


def _numbers(table: RawTable) -> dict[int, Array]:
    """The columns of numbers, without what is empty."""
    found = {}
    for place in range(len(table.headers)) if table.columns is None else table.columns:
        try:
            (array,) = table.column((place,))
        except StudyError:  # texts
            continue
        array = array[np.isfinite(array)]
        if array.size > 1 and np.ptp(array) > 0:
            found[place] = array
    return found


def _unevenness(array: Array) -> float:
    """How far the steps of numbers that rise differ, relative; infinite if they do not rise."""
    step = np.diff(array)
    rises = step.min() > STANDSTILL * float(np.median(step)) > 0
    return float(np.ptp(step) / step.mean()) if rises else math.inf


def _of_times(table: RawTable, numbers: Mapping[int, Array]) -> int | None:
    """The column whose numbers rise most evenly; None if none does but the number of the row."""
    by_unit = [k for k in numbers if unit_of(table.headers[k]) in UNITS["time"]]
    if by_unit:
        return by_unit[0]
    rising = {
        place: _unevenness(array)
        for place, array in numbers.items()
        if array[0] not in (0.0, 1.0) or (np.diff(array) != 1.0).any()
    }
    best = min(rising, key=lambda place: rising[place], default=None)
    return best if best is not None and rising[best] < math.inf else None


def _of_an_opening(table: RawTable, numbers: Mapping[int, Array]) -> int:
    """The column with a unit of an angle, else that which rises most of its range, if unevenly."""
    by_unit = [k for k in numbers if unit_of(table.headers[k]) in UNITS["angle"]]

    def rise(place: int) -> float:
        array = numbers[place]
        if _unevenness(array) < EVEN:  # further times, or the number of the row
            return -1.0
        return round(float((array[-1] - array[0]) / np.ptp(array)), 1)

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
        unit = _likely_unit(dimension, numbers[place])
    return f"{quantity}={_text(table, place)}:{unit}"


def _text(table: RawTable, place: int) -> str:
    """How a column is named: by its header, or its number if others have that too."""
    header = table.headers[place]
    plain = bool(header) and header.isprintable() and table.headers.count(header) == 1
    return header if plain and not header.startswith("column ") else str(place + 1)
