"""A profile from its file: times and values in SI, checked against themselves.

What contradicts itself, or has a unit that its size makes unlikely, is refused with the remedy:
nothing is guessed in silence.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ocp.arrays import Array
from studies.check.reading.digits import half_a_digit, half_a_digit_of_times
from studies.check.reading.headers import (
    DIMENSIONS,
    QUANTITIES,
    Column,
    understood,
)
from studies.check.reading.raw_table import read_table
from studies.check.reading.suggestion import columns_named
from studies.check.reading.table import RawTable, refuse
from studies.common.exit_codes import StudyError, quoted

LEAST_ROWS = 20  # so that the motion between the rows is known
LONGEST = 3600.0  # [s]: a longer deployment is so rare that its unit is asked about
ROUND = 360.0  # no joint of ours turns as many degrees: what is larger is in milliradians
TURNED = 4.0  # [rad]: no joint of ours turns as far, so that these are degrees
ANGLES = {"rad": "radians", "mrad": "milliradians", "deg": "degrees"}
SPARSE = 0.1  # of the rows: if more lack a number, the columns are sampled at other times
SAME = 1e-3  # of the range: columns of one quantity that differ by more contradict each other
TRUSS, ARM = "truss", "arm"
OF_THE_ARM = tuple(name for name in QUANTITIES if name.startswith(("root", "elbow")))


@dataclass(frozen=True, eq=False)
class MeasuredProfile:
    """What a profile says, in SI.

    Attributes
    ----------
    path : of its file.
    time : (m,) from 0 [s].
    values : by quantity, (m,) each [rad, m, N m].
    rounding : half of the last digit of time and values as the file states them, (m,) each.
    mechanism : "truss" or "arm".
    notes : how it was read, and what was assumed, in sentences.
    table : of the file; the place of one of its rows, in words, is `table.line_of(row)`.
    kept : (m,) rows of the table; -1 for one that stands between two of them.
    origin : time 0 by the time of the file [s].
    """

    path: Path
    time: Array
    values: Mapping[str, Array]
    rounding: Mapping[str, Array]
    mechanism: str
    notes: tuple[str, ...]
    table: RawTable
    kept: NDArray[np.intp]
    origin: float

    @property
    def duration(self) -> float:
        """T [s]."""
        return float(self.time[-1])

    @property
    def spacing(self) -> float:
        """Median time between two rows [s]."""
        return float(np.median(np.diff(self.time)))


def read_profile(path: Path, named: Sequence[str] = ()) -> MeasuredProfile:
    """Read a profile of the truss or of the arm.

    Parameters
    ----------
    path : Path
    named : sequence of str
        Columns that the user names, as "angle=Winkel:deg".

    Raises
    ------
    StudyError
        If it cannot be read, contradicts itself, or has a unit that its values make unlikely.
    """
    table = read_table(path)
    columns = understood(table, _asked(named))
    mechanism, chosen = _chosen(table, columns)

    stored = table.column([column.place for column in chosen])
    kept, left_out = _complete(chosen, stored)
    arrays = [array[kept] for array in stored]
    for column, array in zip(chosen, arrays, strict=True):
        _check_finite(table, column, array)
    values = [(column, column.factor * x) for column, x in zip(chosen, arrays, strict=True)]

    (_, time), *others = values
    _check_times(table, time)
    _check_units(table, values)
    return MeasuredProfile(
        path=path,
        time=time - time[0],
        values=_merged(table, others),
        rounding=_roundings(chosen, arrays),
        mechanism=mechanism,
        notes=(*_notes(table, chosen, time), *left_out),
        table=table,
        kept=kept,
        origin=float(time[0]),
    )


def _complete(
    chosen: Sequence[Column], arrays: Sequence[Array]
) -> tuple[NDArray[np.intp], tuple[str, ...]]:
    """The rows with all numbers, if so many lack one that this is how the file is made."""
    whole = np.isfinite(arrays).all(axis=0)
    lacking = int(whole.size - whole.sum())
    if lacking <= SPARSE * whole.size:
        return np.arange(whole.size), ()
    names = ", ".join(f"'{column.header}'" for column in chosen)
    return (
        np.flatnonzero(whole),
        (f"{lacking} rows without a number in each of {names} are ignored",),
    )


def _asked(named: Sequence[str]) -> dict[str, str]:
    asked = {}
    for item in named:
        quantity, equals, header = item.partition("=")
        if not equals or quantity.strip() not in QUANTITIES:
            raise StudyError(
                f"--column is {quoted(item)}; write QUANTITY=HEADER:UNIT, e.g. 'angle=Winkel:deg', "
                f"with one of {', '.join(QUANTITIES)}"
            )
        asked[quantity.strip()] = header.strip()
    return asked


def _chosen(table: RawTable, columns: list[Column]) -> tuple[str, list[Column]]:
    """The mechanism, and the columns to read: time first."""
    times = [column for column in columns if column.quantity == "time"]
    arm = [column for column in columns if column.quantity in OF_THE_ARM]
    truss = [column for column in columns if column.quantity in ("angle", "rope_length")]

    headless = all(header.startswith("column ") for header in table.headers)
    why = ""
    if len(times) > 1:
        names = " and ".join(f"'{column.header}'" for column in times)
        why = f"several columns of time, {names}"
    elif not times or not (arm or truss):
        why = f"no column of {'an angle, a rope length or a torque' if times else 'times'}"
        why = "no header above its numbers" if headless else why
    if why:
        which = f"say which one it is, as in{columns_named(table, columns)}"
        refuse(table.path, f"has {why}; {which}")
    return (ARM, [times[0], *arm]) if arm else (TRUSS, [times[0], *truss])


def _check_finite(table: RawTable, column: Column, array: Array) -> None:
    if array.size < LEAST_ROWS:
        refuse(
            table.path,
            f"has {array.size} rows of numbers; give at least {LEAST_ROWS}, so that the motion "
            "between the rows is determined",
        )
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        more = f" and {bad.size - 1} more" if bad.size > 1 else ""
        refuse(
            table.path,
            f"has no finite number in '{column.header}' in {table.line_of(int(bad[0]))}{more}; "
            "give a number there or remove the row",
        )


def _check_times(table: RawTable, time: Array) -> None:
    """Refuse times that do not increase."""
    step = np.diff(time)
    bad = np.flatnonzero(step <= 0)
    if not bad.size:
        return
    row = int(bad[0]) + 1
    what, remedy = "is earlier than", "sort the rows by time, and keep one run in each file"
    if step[row - 1] == 0:
        what = "repeats"
        remedy = "keep one row for each instant, or write more digits if the times were rounded"
    refuse(
        table.path,
        f"has the time {time[row]:.9g} s in {table.line_of(row)}, which {what} that of the row "
        f"before ({bad.size} such row{'s' * (bad.size > 1)}); {remedy}",
    )


def _check_units(table: RawTable, values: Sequence[tuple[Column, Array]]) -> None:
    """Refuse angles whose size belongs to another unit; nothing is guessed in silence."""
    for column, array in values:
        largest = float(np.abs(array).max()) / column.factor
        like = _likely_unit(column, largest) if DIMENSIONS[column.quantity] == "angle" else ""
        if like:
            stated = f"in {column.unit}" if column.unit else "without a unit, taken in rad"
            corrected = columns_named(table, [one for one, _ in values], **{column.quantity: like})
            refuse(
                table.path,
                f"has angles up to {largest:.6g} in '{column.header}', {stated}: these look like "
                f"{ANGLES[like]}; give the unit, as in{corrected}",
            )


def _likely_unit(column: Column, largest: float) -> str:
    """The unit that the size of angles belongs to, if it is another one than theirs; else empty."""
    if column.factor == 1.0 and largest > TURNED:
        return "mrad" if ROUND < largest <= 1e3 * TURNED else "deg"
    turned = math.degrees(column.factor * largest)
    return "rad" if column.unit and 0 < turned < TURNED and largest < TURNED else ""


def _merged(table: RawTable, values: Sequence[tuple[Column, Array]]) -> dict[str, Array]:
    """One array a quantity; several columns of one have to agree."""
    by_quantity: dict[str, list[tuple[Column, Array]]] = {}
    for column, array in values:
        by_quantity.setdefault(column.quantity, []).append((column, array))
    for group in by_quantity.values():
        for (first, a), (second, b) in pairwise(group):
            miss, size = float(np.abs(a - b).max()), float(np.ptp(a)) or 1.0
            if miss > SAME * size:
                row = int(np.argmax(np.abs(a - b)))
                refuse(
                    table.path,
                    f"contradicts itself: '{first.header}' and '{second.header}' differ by "
                    f"{100 * miss / size:.3g} % of their range in {table.line_of(row)}; keep the "
                    "right one, or correct its unit",
                )
    return {quantity: group[0][1] for quantity, group in by_quantity.items()}


def _roundings(chosen: Sequence[Column], arrays: Sequence[Array]) -> dict[str, Array]:
    """Half of the last digit of each quantity; of several columns of one, of the first."""
    found: dict[str, Array] = {}
    for column, array in zip(chosen, arrays, strict=True):
        half = (half_a_digit_of_times if column.quantity == "time" else half_a_digit)(array)
        found.setdefault(column.quantity, column.factor * half)
    return found


def _notes(table: RawTable, columns: Sequence[Column], time: Array) -> tuple[str, ...]:
    step = np.diff(time)
    even = np.ptp(step) <= 0.01 * np.median(step)
    every = f"every {np.median(step):.4g} s" if even else f"unevenly, {np.median(step):.4g} s apart"
    notes = [
        f"read as {table.dialect}: {'; '.join(column.sentence for column in columns)}",
        f"{time.size} rows {every}, {time[-1] - time[0]:.6g} s in all",
    ]
    if time[0] != 0:
        notes.append(f"its time starts at {time[0]:.6g} s, which is taken as 0")
    if not columns[0].unit and time[-1] - time[0] > LONGEST:
        notes.append(
            f"a duration of {time[-1] - time[0]:.6g} s is unusual: if the times are in ms, write "
            "'time [ms]'"
        )
    return tuple(notes)
