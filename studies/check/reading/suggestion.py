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
from studies.check.reading.headers import DIMENSIONS, ROWS, UNITS, Column, unit_of
from studies.check.reading.table import ROW_NUMBER, RawTable, listed

PERIOD = "0.01 s"  # from row to row
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
    numbers = _numbers(table)
    known = {column.quantity: (column.place, column.unit) for column in reversed(columns)}
    free = numbers.keys() - {column.place for column in columns}
    if "time" not in known:
        place = _of_times(table, {k: numbers[k] for k in sorted(free)})
        known = {"time": (place, PERIOD if place == ROW_NUMBER else ""), **known}
        free.discard(place)
    if not known.keys() - {"time"} and free:
        known["angle"] = (_of_an_opening(table, {k: numbers[k] for k in sorted(free)}), "")

    flags = []
    for quantity, (place, stated) in known.items():
        unit = units.get(quantity) or stated or _likely_unit(table, quantity, place, numbers)
        flags.append(f"--column {shlex.quote(f'{quantity}={_text(table, place)}:{unit}')}")
    return (
        f"\n  antenna-ocp check {shlex.quote(str(table.path))} {' '.join(flags)}\n"
        f"its columns are {listed(table.headers)}"
    )


def _numbers(table: RawTable) -> dict[int, Array]:
    """The columns of numbers, without what is empty."""
    found = {}
    for place in table.numbered:
        (array,) = table.column((place,))
        array = array[np.isfinite(array)]
        if array.size > 1 and np.ptp(array) > 0:
            found[place] = array
    return found


def _likely_unit(table: RawTable, quantity: str, place: int, numbers: Mapping[int, Array]) -> str:
    """The unit that a header states, else one in which numbers are as large as they are."""
    dimension, header = DIMENSIONS[quantity], unit_of(table.headers[place])
    array = numbers.get(place)
    if header in UNITS[dimension]:
        return header
    if array is not None and dimension == "time":
        return next(unit for most, unit in SPANS if np.ptp(array) <= most)
    if array is not None and dimension == "angle":
        return "rad" if np.abs(array).max() <= OPENED else "deg"
    return next(iter(UNITS[dimension]))


def _unevenness(array: Array) -> float:
    """How far the steps of numbers that rise differ, relative; infinite if they do not rise."""
    step = np.diff(array)
    rises = step.min() > STANDSTILL * float(np.median(step)) > 0
    return float(np.ptp(step) / step.mean()) if rises else math.inf


def _of_times(table: RawTable, numbers: Mapping[int, Array]) -> int:
    """The column whose numbers rise most evenly; the number of the row if no other one does."""
    by_unit = [k for k in numbers if unit_of(table.headers[k]) in UNITS["time"]]
    if by_unit:
        return by_unit[0]
    rising = {
        place: _unevenness(array)
        for place, array in numbers.items()
        if array[0] not in (0.0, 1.0) or (np.diff(array) != 1.0).any()
    }
    best = min(rising, key=lambda place: rising[place], default=ROW_NUMBER)
    return best if rising.get(best, math.inf) < math.inf else ROW_NUMBER


def _of_an_opening(table: RawTable, numbers: Mapping[int, Array]) -> int:
    """The column with a unit of an angle, else that which rises most of its range, if unevenly."""
    by_unit = [k for k in numbers if unit_of(table.headers[k]) in UNITS["angle"]]

    def rise(place: int) -> float:
        array = numbers[place]
        if _unevenness(array) < EVEN:  # further times, or the number of the row
            return -1.0
        return round(float((array[-1] - array[0]) / np.ptp(array)), 1)

    return by_unit[0] if by_unit else max(numbers, key=rise)


def _text(table: RawTable, place: int) -> str:
    """How a column is named: by its header, or its number if others have that too."""
    if place == ROW_NUMBER:
        return ROWS
    header = table.headers[place]
    plain = bool(header) and header.isprintable() and table.headers.count(header) == 1
    return header if plain and not header.startswith("column ") else str(place + 1)
