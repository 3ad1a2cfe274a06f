"""Tables of drives as templates: texts of Jinja2 in which the numbers of a motion are put.

A template begins with a comment that states its `TableLayout` in TOML. Each number of a point is
printed between two marks that say which one it is. So a table is read back from its own digits,
whatever stands around them and whatever unit they are in, and what is played is what is written.
"""

from __future__ import annotations

import functools
import re
import tomllib
import traceback
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ocp.arrays import Array
from studies.common.configuration import from_mapping
from studies.common.exit_codes import StudyError
from studies.common.foreign_text import parsed_toml
from studies.common.headers import cell, comments
from studies.drive.setpoints import SetPoints
from studies.export.table_layout import TableLayout

if TYPE_CHECKING:
    import jinja2

FOLDER = Path(__file__).parent / "templates"  # those that come with the program
ENDING = ".j2"
DIGITS = ".15g"  # every count comes back, and rounding of the last bit does not show
_HEAD = re.compile(r"\A\s*\{#(.*?)#\}", re.DOTALL)
# private characters, which no text of a header holds: which kind of number, of which row
_MARKED = re.compile("\ue000(\\d+) (\\d+) ([^\ue001]*)\ue001")

Kind = tuple[str, float, float]  # a column, by what it was multiplied, what was added then


class Number(float):
    """A number of a table, which prints its marks; it stays one when it is scaled and shifted.

    Attributes
    ----------
    kinds : of the numbers of its table, with their places in the order in which they came up.
    kind : the place of its own.
    row : of its point.
    """

    __slots__ = ("kind", "kinds", "row")
    kinds: dict[Kind, int]
    kind: int
    row: int

    def marked(self, text: str) -> str:
        """Its digits between its marks."""
        return f"\ue000{self.kind} {self.row} {text}\ue001"

    def _scaled(self, factor: float, shift: float) -> Number:
        name, before, added = list(self.kinds)[self.kind]
        kind = (name, before * factor, added * factor + shift)
        place = self.kinds.setdefault(kind, len(self.kinds))
        return _number(float(self) * factor + shift, self.kinds, place, self.row)

    def __format__(self, form: str) -> str:
        return self.marked(format(float(self) + 0.0, form or DIGITS))  # -0 is 0

    def __str__(self) -> str:
        return format(self)

    def __mul__(self, other: float) -> Number:
        return self._scaled(_plain(other), 0.0)

    def __truediv__(self, other: float) -> Number:
        return self._scaled(1.0 / _plain(other), 0.0)

    def __add__(self, other: float) -> Number:
        return self._scaled(1.0, _plain(other))

    def __sub__(self, other: float) -> Number:
        return self._scaled(1.0, -_plain(other))

    def __rsub__(self, other: float) -> Number:
        return self._scaled(-1.0, _plain(other))

    # a float would have lost the marks
    def __round__(self, digits: int | None = None) -> Number:  # type: ignore[override]
        return _number(round(float(self), digits or 0), self.kinds, self.kind, self.row)

    def __neg__(self) -> Number:
        return self._scaled(-1.0, 0.0)

    __rmul__, __radd__ = __mul__, __add__


def _plain(other: float) -> float:
    """A number that is of no point: a device that adds differences up adds their rounding, too."""
    if isinstance(other, Number):
        raise TypeError(
            "two numbers of points are joined; take displacement and duration for differences, or "
            "make a plain number of one by the filter float"
        )
    return float(other)


def _number(value: float, kinds: dict[Kind, int], kind: int, row: int) -> Number:
    made = Number(value)
    made.kinds, made.kind, made.row = kinds, kind, row
    return made


@dataclass(frozen=True)
class PointRows:
    """The points of a table as a template sees them; a row is made when it is asked for.

    Attributes
    ----------
    columns : values of each by its name.
    kinds : of the numbers that are printed.
    places : of its rows among the points.
    """

    columns: Mapping[str, list[float]]
    kinds: dict[Kind, int]
    places: range

    def __len__(self) -> int:
        return len(self.places)

    def __getitem__(self, place: int | slice) -> Any:
        if isinstance(place, slice):
            return PointRows(self.columns, self.kinds, self.places[place])
        k = self.places[place]
        return {
            name: _number(values[k], self.kinds, kind, k)
            for kind, (name, values) in enumerate(self.columns.items())
        }

    def __iter__(self) -> Iterator[Any]:
        return map(self.__getitem__, range(len(self)))


@dataclass(frozen=True)
class TableTemplate:
    """A table that a drive takes.

    Attributes
    ----------
    name : of its format, or of its file.
    source : its text.
    layout : that its head states.
    """

    name: str
    source: str
    layout: TableLayout

    def write(
        self, points: SetPoints, about: Mapping[str, str], axes: int
    ) -> tuple[str, SetPoints]:
        """The text of a table, and its points as the drive reads them, their digits included.

        Parameters
        ----------
        about : what the header says.
        axes : that get the same motion.

        Raises
        ------
        StudyError
            If the template fails, lacks a number, or a position is too large for its device.
        """
        largest = self.layout.largest
        if largest is not None and (most := int(np.abs(points.counts).max())) > largest:
            raise StudyError(
                f"the travel has {most} counts, but a target position holds {largest}; "
                "state fewer counts a turn"
            )

        columns = {name: values.tolist() for name, values in _columns(points, self.layout).items()}
        # as they are, the columns are the first kinds of numbers
        kinds: dict[Kind, int] = {(name, 1.0, 0.0): k for k, name in enumerate(columns)}
        rows = PointRows(columns, kinds, range(points.times.size))
        even = points.longest - points.shortest < 1e-9 * points.longest
        text = self._rendered(
            points=rows,
            size=len(rows),
            axes=axes,
            even=even,
            unit=cell(about["unit"]),
            header=lambda opening: "\n".join(comments(about, opening)),
        )
        pieces = _MARKED.split(text)  # a text, then kind, row and digits of a number, and so on
        whole = "".join(piece for k, piece in enumerate(pieces) if k % 4 in (0, 3))
        return whole, self._read(pieces, list(kinds), points)

    def _rendered(self, **values: Any) -> str:
        from jinja2 import TemplateSyntaxError, UndefinedError

        try:
            return compiled(self.name, self.source).render(values)
        except TemplateSyntaxError as error:
            place = f"{error.filename or self.name}, line {error.lineno}"
            raise StudyError(
                f"the template {place} is no text of Jinja2: {error.message}"
            ) from error
        except Exception as error:  # whatever the text of somebody else asks for
            lines = traceback.extract_tb(error.__traceback__)
            line = next((one.lineno for one in reversed(lines) if one.filename == self.name), None)
            place = self.name + (f", line {line}" if line else "")
            known = (
                f"{', '.join(sorted(values))}, and of a point {', '.join(values['points'].columns)}"
            )
            hint = f"; known are {known}" if isinstance(error, UndefinedError) else ""
            what = f"{type(error).__name__}, {error}{hint}"
            raise StudyError(f"the template {place} fails: {what}") from error

    def _read(self, pieces: list[str], kinds: list[Kind], points: SetPoints) -> SetPoints:
        """The points that a table holds, from the digits between the marks of its text."""
        kind, row = (np.array(marks, dtype=int) for marks in (pieces[1::4], pieces[2::4]))
        digits = [one.replace(",", ".") for one in pieces[3::4]]
        try:
            values = np.array(digits, dtype=float)
        except ValueError as error:
            raise StudyError(
                f"the template {self.name} prints a number of a point that is none: {error}; "
                "change nothing of its digits but the decimal sign"
            ) from error
        names, factors, shifts = (np.array(column) for column in zip(*kinds, strict=True))
        with np.errstate(
            divide="ignore", invalid="ignore"
        ):  # what is printed times zero says nothing
            values = (values - shifts[kind]) / factors[kind]

        layout, read = self.layout, {}
        for name, exact in _columns(points, layout).items():
            here = (names[kind] == name) & np.isfinite(values)
            read[name] = _one_of_each(row[here], values[here], exact)
            if layout.first and np.isnan(read[name][0]):  # not written: the axis rests at its place
                read[name][0] = 0.0 if name == "acceleration" else exact[0]
            missing = np.flatnonzero(np.isnan(read[name]))
            if name in layout.columns and missing.size:
                raise StudyError(
                    f"the template {self.name} writes no {name} of point "
                    f"{missing[0] + 1} of {points.times.size}; put "
                    f"{{{{ point.{name} }}}} there, or '{{:.6f}}'.format(point.{name})"
                )
        return self._points(read, points)

    def _points(self, read: Mapping[str, Array], points: SetPoints) -> SetPoints:
        """Points of the columns that were read; what these do not hold is zero."""
        columns = self.layout.columns
        unit = points.count or 1.0 if self.layout.in_counts else 1.0
        start = float(points.positions[0])  # a table of displacements begins where the axis stands

        def rates(name: str) -> Array:
            return unit * read[name] if name in columns else 0.0 * points.times

        times = read["time"]
        if "duration" in columns:
            times = np.cumsum(read["duration"])
        elif self.layout.even:
            times = _even(times, points.times)
        if not (np.diff(times) > 0.0).all():
            late = int(np.flatnonzero(~(np.diff(times) > 0.0))[0])
            raise StudyError(
                f"the template {self.name} writes no later time for point {late + 2} than for "
                f"point {late + 1}, {times[late]:.6g} s; print more digits of it"
            )
        if "displacement" in columns:
            positions = start + unit * np.cumsum(read["displacement"])
        else:
            positions = unit * read["position"]
        step = unit if self.layout.whole_velocities else 0.0
        return SetPoints(
            times, positions, rates("velocity"), rates("acceleration"), points.count, step
        )


def shipped(name: str) -> TableTemplate:
    """The template of a format that comes with the program."""
    return template_of(FOLDER / (name + ENDING), name)


def template_of(path: Path, name: str = "") -> TableTemplate:
    """The template of a file.

    Raises
    ------
    StudyError
        If it cannot be read, or its head does not state the layout of a table.
    """
    try:
        source = path.read_bytes().decode("utf-8")
    except OSError as error:
        raise StudyError(f"the template {path} cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise StudyError(
            f"the template {path} is not text in UTF-8 (from byte {error.start}); save it as UTF-8"
        ) from error

    head = _HEAD.match(source)
    if head is None:
        raise StudyError(
            f"the template {path} does not begin with its columns; write a comment such as "
            '{# columns = ["time", "position"] #} above, as the page "Export formats" says'
        )
    try:
        layout = from_mapping(TableLayout, parsed_toml(head[1].replace("\r", "")))
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"the head of the template {path} is not valid TOML: {error}") from error
    except (StudyError, ValueError) as error:
        raise StudyError(f"the head of the template {path} is refused: {error}") from error
    return TableTemplate(name or str(path), source, layout)


@functools.cache
def compiled(name: str, source: str = "") -> jinja2.Template:
    """A template, which has no way to files, modules and attributes of objects.

    Parameters
    ----------
    source : of one of the user's; one that comes with the program is found by its name.
    """
    from jinja2 import ChoiceLoader, FileSystemLoader, FunctionLoader, StrictUndefined
    from jinja2.sandbox import ImmutableSandboxedEnvironment

    own = FunctionLoader(lambda asked: (source, name, None) if source and asked == name else None)
    environment = ImmutableSandboxedEnvironment(
        loader=ChoiceLoader([own, FileSystemLoader(FOLDER)]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        newline_sequence="\r\n" if "\r\n" in source else "\n",
    )
    environment.filters["real"] = _real
    return environment.get_template(name)


def _columns(points: SetPoints, layout: TableLayout) -> dict[str, Array]:
    """What a template can print of its points: their times and positions, and its columns."""
    unit = points.count or 1.0 if layout.in_counts else 1.0
    positions = points.counts.astype(float) if layout.in_counts else points.positions
    velocities = points.velocities / unit
    every = {
        "time": points.times,
        "duration": np.diff(points.times, prepend=0.0),
        "position": positions,
        "displacement": np.diff(positions, prepend=positions[0]),
        "velocity": np.rint(velocities) if layout.whole_velocities else velocities,
        "acceleration": points.accelerations / unit,
    }
    return {
        name: values
        for name, values in every.items()
        if name in layout.columns or name in ("time", "position")
    }


def _one_of_each(rows: Array, read: Array, exact: Array) -> Array:
    """A number of each row; of several, as of two axes, the one that is rounded worst."""
    values = np.full(exact.size, np.nan)
    order = np.argsort(np.abs(read - exact[rows]), kind="stable")
    values[rows[order]] = read[order]
    return values


def _even(read: Array, exact: Array) -> Array:
    """Times of equal steps, as the table says where it says it."""
    said = np.flatnonzero(read > 0.0)  # not where it says nothing
    if not said.size:
        return exact
    k = int(said[np.argmax(np.abs(read[said] - exact[said]))])
    times: Array = read[k] / k * np.arange(exact.size)
    return times


def _real(value: float) -> str:
    """A literal of structured text, which needs a decimal point."""
    text = format(float(value) + 0.0, DIGITS)
    if "e" in text:
        mantissa, exponent = text.split("e")
        text = f"{mantissa if '.' in mantissa else mantissa + '.0'}E{int(exponent)}"
    elif "." not in text:
        text += ".0"
    return value.marked(text) if isinstance(value, Number) else text
