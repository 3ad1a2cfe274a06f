"""Names and units of columns as people write them: `Time [ms]`, `angle (deg)`, `rope_length_mm`."""

from __future__ import annotations

import math
import re
import unicodedata
from dataclasses import dataclass

from studies.check.reading.raw_table import RawTable, listed, refuse
from studies.common.configuration import nearest

# a unit in SI, by the way it is written; each group is a quantity's dimension
UNITS: dict[str, dict[str, float]] = {
    "time": {
        **dict.fromkeys(("s", "sec", "secs", "second", "seconds", "sekunden"), 1.0),
        **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), 1e-3),
        **dict.fromkeys(("us", "µs", "μs", "microseconds"), 1e-6),
        **dict.fromkeys(("min", "minute", "minutes"), 60.0),
        **dict.fromkeys(("h", "hour", "hours"), 3600.0),
    },
    "angle": {
        **dict.fromkeys(("rad", "radian", "radians"), 1.0),
        "mrad": 1e-3,
        **dict.fromkeys(("deg", "°", "degree", "degrees"), math.pi / 180),
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
    "time": "time|t|zeit|temps|tiempo|tempo|elapsed time|time stamp|timestamp",
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
    place : of the column in its table.
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
    return plain in ("1", "-", "n", "w", "v", "a") or any(
        plain in known for known in UNITS.values()
    )


def _plain_unit(text: str) -> str:
    return unicodedata.normalize("NFC", text.strip()).lower()


def _plain_name(text: str) -> str:
    spaced = _CAMEL.sub(" ", text.strip().strip("'\""))
    return re.sub(r"[\s_\-]+", " ", unicodedata.normalize("NFC", spaced)).strip().lower()


def understood(table: RawTable, asked: dict[str, str] | None = None) -> list[Column]:
    """The columns of a table that are understood.

    Parameters
    ----------
    asked : mapping, optional
        Headers that the user names, by quantity, each with a unit in brackets where he gives one.

    Raises
    ------
    StudyError
        If a unit of such a column is unknown, or a column that the user names is not there.
    """
    asked = asked or {}
    named = {
        _place(table, header): (quantity, _split(header)[1]) for quantity, header in asked.items()
    }
    columns = []
    for place, header in enumerate(table.headers):
        if place in named:
            quantity, unit = named[place]
            unit = unit or _split(header)[1]
        else:
            name, unit = _split(header)
            quantity = NAMES.get(_plain_name(name), "")
            if not quantity or quantity in asked:
                continue
        columns.append(_column(table, quantity, place, header, unit))
    return columns


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


def _column(table: RawTable, quantity: str, place: int, header: str, unit: str) -> Column:
    dimension = DIMENSIONS[quantity]
    known = UNITS[dimension]
    if not unit:
        return Column(quantity, place, header, "", 1.0)
    if _plain_unit(unit) not in known:
        some = ", ".join(sorted(known, key=lambda text: (len(text), text))[:6])
        refuse(
            table.path,
            f"has the header '{header}', but '{unit}' is no unit of {dimension}; write one of "
            f"{some}",
        )
    return Column(quantity, place, header, unit, known[_plain_unit(unit)])


def _place(table: RawTable, header: str) -> int:
    """Place of a column that the user names by its header or its number from 1."""
    name = _split(header)[0].strip()
    texts = [_plain_name(_split(known)[0]) for known in table.headers]
    if header in table.headers:
        return table.headers.index(header)
    if _plain_name(name) in texts:
        return texts.index(_plain_name(name))
    if not (name.isdecimal() and 1 <= int(name) <= len(table.headers)):
        near = nearest(_plain_name(name), texts)
        hint = f"did you mean '{near}'?" if near else f"it has {listed(table.headers)}"
        refuse(table.path, f"has no column '{name}'; {hint}")
    return int(name) - 1
