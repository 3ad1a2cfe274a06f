"""Reads the file of a profile, by what it holds: text, JSON, MATLAB or Excel."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ocp.arrays import Array
from studies.check.reading.delimited import read_delimited
from studies.check.reading.layout import number_of
from studies.check.reading.table import RawTable, refuse
from studies.common.exit_codes import StudyError
from studies.common.foreign_text import parsed_json

MOST_COLUMNS = 64  # of a matrix
DEEP = 4  # structures within structures
ROOM = 1024  # bytes from which a kind of file is told

# beginnings of files that people hand over by mistake, and what to do with them
_SIGNATURES = {
    b"MATLAB 7.3 MAT-file": "is a MATLAB file of version 7.3; save it with -v7, or as CSV",
    b"\x89HDF": "is an HDF5 file, as MATLAB writes with -v7.3; save it with -v7, or as CSV",
    b"\xd0\xcf\x11\xe0": "is an old Excel file (.xls); save it as .xlsx or CSV",
    b"PAR1": "is a Parquet file; save it as CSV",
    b"\x1f\x8b": "is compressed (gzip); unpack it first",
    b"\x93NUMPY": "is a NumPy array without names; save it as CSV with a header",
}
_MATLAB = b"MATLAB 5.0 MAT-file"
_ZIP = b"PK\x03\x04"


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
    for signature, what in _SIGNATURES.items():
        if head.startswith(signature):
            refuse(path, what)
    if head.startswith(_MATLAB) or path.suffix.lower() == ".mat":
        return _from_matlab(path)
    if head.startswith(_ZIP):
        return _from_excel(path)
    if head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith((b"{", b"[")):
        return _from_json(path)
    return read_delimited(path)


def _of_columns(path: Path, columns: Mapping[str, Any], dialect: str) -> RawTable:
    """A table whose columns become numbers when they are asked for: others may hold texts."""
    names = tuple(columns)

    def column(places: tuple[int, ...]) -> list[Array]:
        chosen = {names[k]: np.array(list(map(number_of, columns[names[k]]))) for k in places}
        if len({values.size for values in chosen.values()}) > 1:
            counts = ", ".join(f"{name} has {values.size}" for name, values in chosen.items())
            refuse(path, f"has columns of different lengths: {counts}; give one value an instant")
        return list(chosen.values())

    return RawTable(path, names, column, dialect)


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

    columns = {}
    for name, values in content.items() if isinstance(content, dict) else ():
        unit = values.get("unit") if isinstance(values, dict) else None
        values = values.get("values") if isinstance(values, dict) else values
        if isinstance(values, list) and not any(isinstance(v, list | dict) for v in values):
            columns[f"{name} [{unit}]" if unit else str(name)] = values
    if not columns:
        refuse(path, "is JSON without columns; give an object of lists, one a column")
    return _of_columns(path, columns, "JSON")


def _from_matlab(path: Path) -> RawTable:
    """Vectors of a .mat file, those in structures too, under their own names."""
    from scipy.io import loadmat

    try:
        content = loadmat(path, squeeze_me=True, struct_as_record=False)
    except Exception as error:  # a damaged file ends in whatever the reader stumbles over
        refuse(path, f"cannot be read as a MATLAB file ({error}); save it with -v7, or as CSV")

    vectors = dict(_vectors(content))
    if not vectors:
        refuse(path, "holds no vector of numbers; save time and angle as vectors")
    return _of_columns(path, vectors, "MATLAB")


def _vectors(content: Any, inside: str = "", depth: int = 0) -> list[tuple[str, Array]]:
    """Names and values of all vectors of real numbers, and of the columns of a matrix."""
    items = content.items() if isinstance(content, dict) else vars(content).items()
    found: list[tuple[str, Array]] = []
    for name, value in items:
        if name.startswith("_"):
            continue
        several = isinstance(value, np.ndarray) and value.dtype == object
        for part in value.flat if several else [value]:
            if hasattr(part, "_fieldnames") and depth < DEEP:
                found += _vectors(part, f"{inside}{name}." if depth else "", depth + 1)
            elif isinstance(part, np.ndarray) and part.dtype.kind in "iuf" and 0 < part.ndim < 3:
                found += _columns_of(inside + name, part.astype(float))
    return found


def _columns_of(name: str, values: Array) -> list[tuple[str, Array]]:
    """A vector, or the columns of a matrix, which may lie on its side."""
    if values.ndim == 1:
        return [(name, values)]
    upright = values if values.shape[0] >= values.shape[1] else values.T
    return [(f"{name}({k + 1})", column) for k, column in enumerate(upright.T[:MOST_COLUMNS])]


def _from_excel(path: Path) -> RawTable:
    """The first sheet that has a table, read like the text that it would be with tabs."""
    try:
        from openpyxl import load_workbook
    except ImportError:
        refuse(path, "is an Excel file; install antenna-ocp[excel] to read it, or save it as CSV")

    try:
        book = load_workbook(path, read_only=True, data_only=True)
        sheets = {sheet.title: _with_tabs(sheet.iter_rows(values_only=True)) for sheet in book}
        book.close()
    except Exception as error:  # a zip that is no workbook, or a damaged one
        refuse(path, f"cannot be read as an Excel file ({error}); save it as CSV")

    failures = []
    for title, text in sheets.items():
        try:
            table = read_delimited(path, text)
        except StudyError as error:
            failures.append(error)
            continue
        return dataclasses.replace(table, dialect=f"Excel, sheet '{title}'")
    raise failures[0]


def _with_tabs(rows: Any) -> bytes:
    text = io.StringIO()
    cells = (["" if cell is None else " ".join(str(cell).split()) for cell in row] for row in rows)
    csv.writer(text, delimiter="\t", lineterminator="\n").writerows(cells)
    return text.getvalue().encode()
