"""Names and units of columns as people write them: `Time [ms]`, `angle (deg)`, `rope_length_mm`."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass

from studies.check.reading.table import ROW_NUMBER, RawTable, listed, refuse
from studies.common.configuration import nearest

# a unit in SI, by the way it is written; each group is a quantity's dimension
UNITS: dict[str, dict[str, float]] = {
    "time": {
        **dict.fromkeys(("s", "sec", "secs", "second", "seconds", "sekunden"), 1.0),
        **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), 1e-3),
        **dict.fromkeys(("us", "µs", "μs", "usec", "microseconds"), 1e-6),
        **dict.fromkeys(("ns", "nsec", "nanoseconds"), 1e-9),
        **dict.fromkeys(("min", "minute", "minutes"), 60.0),
        **dict.fromkeys(("h", "hour", "hours"), 3600.0),
    },
    "angle": {
        **dict.fromkeys(("rad", "radian", "radians"), 1.0),
        "mrad": 1e-3,
        **dict.fromkeys(("deg", "°", "degree", "degrees", "grad"), math.pi / 180),
        "mdeg": math.pi / 180e3,
        **dict.fromkeys(("rev", "turn", "turns"), 2 * math.pi),
    },
    "length": {
        **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), 1.0),
        **dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), 1e-3),
        "cm": 1e-2,
        **dict.fromkeys(("in", "inch", "inches"), 0.0254),
        **dict.fromkeys(("ft", "feet"), 0.3048),
    },
    "torque": {
        **dict.fromkeys(("nm", "n m", "n·m", "n*m", "n.m", "n-m"), 1.0),
        **dict.fromkeys(("mnm", "mn m", "mn·m"), 1e-3),
        **dict.fromkeys(("knm", "kn m", "kn·m"), 1e3),
    },
}
# of other quantities, which stand beside these in a row of units
OTHER_UNITS = ("1", "-", "n", "w", "v", "a", "k", "%", "°c", "rpm", "volt", "volts", "counts")
ROWS = "row"  # in place of a header: the number of the row, from 0
SI = {"time": "s", "angle": "rad", "length": "m", "torque": "N m"}
DIMENSIONS = {
    "time": "time",
    "angle": "angle",
    "rope_length": "length",
    "root_angle": "angle",
    "elbow_angle": "angle",
    "root_torque": "torque",
    "elbow_torque": "torque",
}
QUANTITIES = tuple(DIMENSIONS)

# other names of a quantity, with bars between them
_NAMES = {
    "time": "time|t|zeit|temps|tiempo|tempo|elapsed time|time stamp|timestamp|uhrzeit|x value",
    "angle": "angle|alpha|α|phi|theta|winkel|deployment angle|angolo|ángulo|measured angle",
    "rope_length": "rope length|rope|length of rope|length|l|cable length|seillänge|cord length",
    "root_angle": "root angle|angle root|shoulder angle|joint 1 angle|q1",
    "elbow_angle": "elbow angle|angle elbow|joint 2 angle|q2",
    "root_torque": "root torque|torque root|shoulder torque|joint 1 torque|tau1",
    "elbow_torque": "elbow torque|torque elbow|joint 2 torque|tau2",
}
NAMES = {name: quantity for quantity, names in _NAMES.items() for name in names.split("|")}

_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[(<{](?P<unit>[^\])>}]*)[\])>}]\s*$")
_BEHIND = re.compile(r"^(?P<name>.*?)\s*(?:/| in )\s*(?P<unit>[^\s/]+(?: ?m)?)$", re.IGNORECASE)
_SUFFIX = re.compile(r"^(?P<name>.*)[_\s](?P<unit>[^_\s]+)$")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])")


@dataclass(frozen=True)
class Column:
    """A column that is understood.

    Attributes
    ----------
    quantity : one of `QUANTITIES`.
    place : of the column in its table; `ROW_NUMBER` if it is the number of the row.
    header : as it stands in the file.
    unit : as it stands in the file; empty where none is stated.
    factor : from that unit to SI.
    """

    quantity: str
    place: int
    header: str
    unit: str
    factor: float

    @property
    def sentence(self) -> str:
        """What the column is taken for."""
        words = f"'{self.header}' is {self.quantity.replace('_', ' ')}"
        if self.unit:
            return f"{words} in {self.unit}"
        return f"{words}, without a unit and taken in {SI[DIMENSIONS[self.quantity]]}"


def is_unit(text: str) -> bool:
    """Whether a text is a unit and nothing else."""
    plain = _plain_unit(text)
    return plain in OTHER_UNITS or any(plain in known for known in UNITS.values())


def unit_of(header: str) -> str:
    """The unit that a header states, as `UNITS` writes it; empty for none."""
    return _plain_unit(_split(header)[1])


def says_something(cell: str) -> bool:
    """Whether a cell of a header names a quantity or a unit that is understood."""
    name, unit = _split(cell)
    if _plain_name(name) in NAMES:
        return True
    return bool(unit) and any(_plain_unit(unit) in known for known in UNITS.values())


def _plain_unit(text: str) -> str:
    return unicodedata.normalize("NFC", text.strip()).lower()


def _plain_name(text: str) -> str:
    spaced = _CAMEL.sub(" ", text.strip().strip("'\""))
    return re.sub(r"[\s_\-]+", " ", unicodedata.normalize("NFC", spaced)).strip().lower()


def understood(table: RawTable, asked: Mapping[str, str]) -> list[Column]:
    """The columns of a table that are understood: by their names, or by a unit that one alone has.

    Parameters
    ----------
    asked : mapping
        Headers that the user names, by quantity, each with ":UNIT" behind it if he gives one.

    Raises
    ------
    StudyError
        If a unit of such a column is unknown, or a column that the user names is not there.
    """
    columns = [
        _column(table, quantity, *_located(table, text, UNITS[DIMENSIONS[quantity]]))
        for quantity, text in asked.items()
    ]
    taken = {column.place for column in columns}
    stated = [_split(header) for header in table.headers]
    for place, (name, unit) in enumerate(stated):
        quantity = NAMES.get(_plain_name(name), "")
        if quantity and quantity not in asked and place not in taken:
            columns.append(_column(table, quantity, place, unit))

    # else the one column of times, or of angles, by its unit
    known = {DIMENSIONS[column.quantity] for column in columns}
    wanted = ["time"] * ("time" not in known) + ["angle"] * (not known - {"time"})
    for quantity in wanted:
        places = [k for k, (_, unit) in enumerate(stated) if _plain_unit(unit) in UNITS[quantity]]
        if len(places) == 1:
            columns.append(_column(table, quantity, places[0], stated[places[0]][1]))
    return columns


def own_column(table: RawTable, name: str, unit: str, asked: str = "") -> tuple[int, float]:
    """The place of a column of which a study says the unit, and the factor to that unit.

    Parameters
    ----------
    asked : str
        Header or number that the user names, with ":UNIT" behind it if he gives one.

    Raises
    ------
    StudyError
        If there is no such column, or its unit is another kind of unit.
    """
    plain = _plain_unit(unit)
    kinds = (units for units in UNITS.values() if units.get(plain) == 1.0)
    known = next(kinds, {plain: 1.0})
    place, written = _located(table, asked or name, known)
    factor = _factor(written or unit, known)
    if factor is None:
        refuse(table.path, f"has {name} in '{written}', not in {unit}; write the column in {unit}")
    return place, factor


def _located(table: RawTable, text: str, known: Mapping[str, float]) -> tuple[int, str]:
    """Place and unit of the column that a user names as HEADER, HEADER:UNIT or HEADER [UNIT]."""
    header, colon, unit = text.rpartition(":")
    if not colon or text in table.headers or _factor(unit, known) is None:
        header, unit = text, ""
    if header.strip() == ROWS and ROWS not in table.headers:
        return ROW_NUMBER, unit
    place = _place(table, header.strip())
    return place, unit or _split(header)[1] or _split(table.headers[place])[1]


def _factor(unit: str, known: Mapping[str, float]) -> float | None:
    """From a unit to SI, as of "deg", or of "12.5 deg" for a volt or a count; None if unknown."""
    number, _, rest = unit.strip().partition(" ")
    if _plain_unit(unit) in known:
        return known[_plain_unit(unit)]
    try:
        factor = float(number) * known[_plain_unit(rest)]
    except (ValueError, KeyError):
        return None
    return factor if math.isfinite(factor) and factor != 0.0 else None


def _split(header: str) -> tuple[str, str]:
    """Name and unit of a header; the unit empty where there is none."""
    for pattern in (_BRACKETED, _BEHIND):
        match = pattern.match(header)
        if match is not None:
            return match["name"], match["unit"].strip()
    match = _SUFFIX.match(header)
    if match is not None and is_unit(match["unit"]) and _plain_name(header) not in NAMES:
        return match["name"], match["unit"]
    return header, ""


def _column(table: RawTable, quantity: str, place: int, unit: str) -> Column:
    header = ROWS if place == ROW_NUMBER else table.headers[place]
    dimension = DIMENSIONS[quantity]
    factor = _factor(unit, UNITS[dimension]) if unit else 1.0
    if factor is None:
        some = ", ".join(sorted(UNITS[dimension], key=lambda text: (len(text), text))[:6])
        refuse(
            table.path,
            f"has the header '{header}', but '{unit}' is no unit of {dimension}; write one of "
            f"{some}, or give it by --column {quantity}=HEADER:UNIT",
        )
    return Column(quantity, place, header, unit, factor)


def _place(table: RawTable, header: str) -> int:
    """Place of a column that the user names by its header or its number from 1."""
    name = _split(header)[0].strip()
    texts = [_plain_name(_split(known)[0]) for known in table.headers]
    if header in table.headers:
        return table.headers.index(header)
    for text in (header, name):  # what is behind a bar may be a unit, or belong to the name
        if _plain_name(text) in texts:
            return texts.index(_plain_name(text))
    if not (name.isdecimal() and 1 <= int(name) <= len(table.headers)):
        near = nearest(_plain_name(name), texts)
        hint = f"did you mean '{near}'?" if near else f"it has {listed(table.headers)}"
        refuse(table.path, f"has no column '{name}'; {hint}")
    return int(name) - 1
