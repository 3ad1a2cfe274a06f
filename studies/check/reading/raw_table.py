"""What a file of a profile holds: the texts of its headers, and numbers below them.

Nothing is known here of angles or ropes. Whatever cannot be read is answered with what to do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ocp.arrays import Array
from studies.common.exit_codes import StudyError, quoted
from studies.common.foreign_text import parsed_json

LISTED = 8  # headers that a sentence lists
ROOM = 1024  # bytes from which a kind of file is told

# beginnings of files that people hand over by mistake, and what to do with them
_SIGNATURES: tuple[tuple[bytes, str], ...] = (
    (b"\x89HDF", "an HDF5 file, as MATLAB writes with -v7.3; save it with -v7, or as CSV"),
    (b"\xd0\xcf\x11\xe0", "an old Excel file (.xls); save it as .xlsx or CSV"),
    (b"PAR1", "a Parquet file; save it as CSV"),
    (b"\x1f\x8b", "compressed (gzip); unpack it first"),
    (b"%PDF", "a PDF; give the table itself, as CSV"),
    (b"\x93NUMPY", "a NumPy array without names; save it as CSV with a header"),
)
_MATLAB = b"MATLAB 5.0 MAT-file"
_MATLAB_7_3 = b"MATLAB 7.3 MAT-file"
_ZIP = b"PK\x03\x04"


@dataclass(frozen=True, eq=False)
class RawTable:
    """Columns as they stand in a file.

    Attributes
    ----------
    path : of the file.
    headers : the text above each column, in order; its unit with it where the file states one.
    column : the numbers (m,) of the columns at the given places; nan where a cell is empty.
    dialect : what was recognised, in words.
    line_of : the line, row or place of a number in its column, as a reader of the file counts.
    """

    path: Path
    headers: tuple[str, ...]
    column: Callable[[tuple[int, ...]], list[Array]]
    dialect: str
    line_of: Callable[[int], str] = field(default=lambda row: f"row {row + 1}")


def refusal(path: Path, reason: str) -> StudyError:
    """The error that names the file."""
    return StudyError(f"the profile {path} {reason}")


def refuse(path: Path, reason: str) -> NoReturn:
    """Raise StudyError that names the file."""
    raise refusal(path, reason)


def listed(headers: tuple[str, ...]) -> str:
    """The headers of a table for a sentence."""
    shown = ", ".join(f"'{header}'" for header in headers[:LISTED])
    return shown + (f" and {len(headers) - LISTED} more" if len(headers) > LISTED else "")


def read_table(path: Path) -> RawTable:
    """Read a file, by what it holds and not by its name.

    Text with columns (see `delimited`), JSON, MATLAB up to v7, and Excel's .xlsx are read.

    Raises
    ------
    StudyError
        Naming the file, what is wrong with it and what to do.
    """
    try:
        with path.open("rb") as file:
            head = file.read(ROOM)
    except OSError as error:
        raise StudyError(f"the profile {path} cannot be read ({error.strerror})") from error

    if not head.strip():
        refuse(path, "is empty; give a header and one line for each instant")
    if head.startswith(_MATLAB_7_3):
        refuse(path, "is a MATLAB file of version 7.3; save it with -v7, or as CSV")
    for signature, what in _SIGNATURES:
        if head.startswith(signature):
            refuse(path, f"is {what}")
    if head.startswith(_MATLAB) or path.suffix.lower() == ".mat":
        return _from_matlab(path)
    if head.startswith(_ZIP):
        return _from_excel(path)
    if head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith((b"{", b"[")):
        return _from_json(path)

    from studies.check.reading.delimited import read_delimited

    return read_delimited(path)


def stored(path: Path, columns: Mapping[str, Array], dialect: str) -> RawTable:
    """A table of columns that are at hand; those of other lengths are refused when asked for."""
    names = tuple(columns)

    def column(places: tuple[int, ...]) -> list[Array]:
        chosen = [columns[names[place]] for place in places]
        lengths = {names[place]: columns[names[place]].size for place in places}
        if len(set(lengths.values())) > 1:
            counts = ", ".join(f"{name} has {size}" for name, size in lengths.items())
            refuse(path, f"has columns of different lengths: {counts}; give one value an instant")
        return chosen

    return RawTable(path, names, column, dialect)


def _numbers(path: Path, name: str, values: Any) -> Array:
    """A list of JSON or Excel as numbers; nothing and texts without number are told."""
    numbers = np.empty(len(values))
    for row, value in enumerate(values):
        if value is None or value == "":
            numbers[row] = np.nan
            continue
        try:
            numbers[row] = float(value)
        except (TypeError, ValueError):
            refuse(path, f"has {quoted(value)} in row {row + 1} of {name}; give numbers only")
    return numbers


def _from_json(path: Path) -> RawTable:
    """Our own export, or an object of lists, or a list of objects."""
    try:
        content = parsed_json(path.read_text("utf-8-sig"))
    except ValueError as error:  # those of JSON and UTF-8, too
        refuse(path, f"cannot be understood as JSON ({error}); give CSV or valid JSON")

    if isinstance(content, dict) and isinstance(content.get("columns"), dict):
        content = content["columns"]
    if isinstance(content, list) and content and all(isinstance(row, dict) for row in content):
        content = {name: [row.get(name) for row in content] for name in content[0]}
    if not isinstance(content, dict):
        refuse(path, "is JSON without columns; give an object of lists, one a column")

    columns = {}
    for name, values in content.items():
        unit = values.get("unit") if isinstance(values, dict) else None
        values = values.get("values") if isinstance(values, dict) else values
        if isinstance(values, list) and not any(isinstance(v, list | dict) for v in values):
            header = f"{name} [{unit}]" if unit else str(name)
            columns[header] = values
    if not columns:
        refuse(path, "is JSON without columns; give an object of lists, one a column")
    return _lazy(path, columns, "JSON")


def _lazy(path: Path, columns: Mapping[str, list[Any]], dialect: str) -> RawTable:
    """A table whose cells become numbers when they are asked for: other columns may hold texts."""
    names = tuple(columns)

    def column(places: tuple[int, ...]) -> list[Array]:
        chosen = {names[k]: _numbers(path, names[k], columns[names[k]]) for k in places}
        return stored(path, chosen, dialect).column(tuple(range(len(chosen))))

    return RawTable(path, names, column, dialect)


def _from_matlab(path: Path) -> RawTable:
    """Vectors of a .mat file, those in structures too, under their own names."""
    from scipy.io import loadmat

    try:
        content = loadmat(path, squeeze_me=True, struct_as_record=False)
    except NotImplementedError:
        refuse(path, "is a MATLAB file of version 7.3; save it with -v7, or as CSV")
    except Exception as error:  # a damaged file ends in whatever the reader stumbles over
        refuse(path, f"cannot be read as a MATLAB file ({error}); save it with -v7, or as CSV")

    columns = dict(_vectors(content))
    if not columns:
        refuse(path, "holds no vector of numbers; save time and angle as vectors")
    return stored(path, columns, "MATLAB")


def _vectors(content: Any, depth: int = 0) -> list[tuple[str, Array]]:
    """Names and values of all vectors of real numbers."""
    items = content.items() if isinstance(content, dict) else vars(content).items()
    found: list[tuple[str, Array]] = []
    for name, value in items:
        if name.startswith("_"):
            continue
        if hasattr(value, "_fieldnames") and depth < 2:
            found += _vectors(value, depth + 1)
        elif isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "iuf":
            found.append((name, value.astype(float)))
    return found


def _from_excel(path: Path) -> RawTable:
    """The first sheet that has a table: the row above its first numbers is its header."""
    try:
        from openpyxl import load_workbook
    except ImportError:
        refuse(path, "is an Excel file; install antenna-ocp[excel] to read it, or save it as CSV")

    try:
        book = load_workbook(path, read_only=True, data_only=True)
        sheets = [(sheet.title, list(sheet.iter_rows(values_only=True))) for sheet in book]
        book.close()
    except Exception as error:  # a zip that is no workbook, or a damaged one
        refuse(path, f"cannot be read as an Excel file ({error}); save it as CSV")

    for title, rows in sheets:
        table = _table_of(rows)
        if table:
            return _lazy(path, table, f"Excel, sheet '{title}'")
    refuse(path, "is an Excel file without a header above columns of numbers; save it as CSV")


def _table_of(rows: list[tuple[Any, ...]]) -> dict[str, list[Any]]:
    """Columns below the last row of texts before the first row of numbers."""

    def is_numeric(row: tuple[Any, ...]) -> bool:
        cells = [cell for cell in row if cell is not None]
        return bool(cells) and all(isinstance(cell, int | float) for cell in cells)

    first = next((k for k, row in enumerate(rows) if is_numeric(row)), 0)
    if first == 0:
        return {}
    body = [row for row in rows[first:] if any(cell is not None for cell in row)]
    above = rows[first - 1]
    return {
        str(header).strip(): [row[place] for row in body]
        for place, header in enumerate(above)
        if header is not None
    }
