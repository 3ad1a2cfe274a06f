"""The whole profile as columns: CSV in any dialect, JSON with a schema, MATLAB, Parquet."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.common.folder import plain
from studies.common.result import Result
from studies.common.writers import about, flat

SCHEMA_FILE = "profile.schema.json"
MATLAB_NAME = 31  # letters of a name that every version of MATLAB reads


@dataclass(frozen=True)
class Dialect:
    """How CSV is written.

    Attributes
    ----------
    separator : between cells, one character.
    decimal : sign of the decimals, "." or ",".
    header : whether comments and names of columns stand above.

    Raises
    ------
    StudyError
        If the two signs are the same, or are none.
    """

    separator: str = ","
    decimal: str = "."
    header: bool = True

    def __post_init__(self) -> None:
        named = {"tab": "\t", "\\t": "\t", "semicolon": ";", "comma": ",", "space": " "}
        separator = named.get(self.separator, self.separator)
        object.__setattr__(self, "separator", separator)
        if len(separator) != 1 or separator.isalnum() or separator in '."#-+\n\r':
            raise StudyError(
                f"--separator is {self.separator!r}; give one sign such as ',' ';' or tab"
            )
        if self.decimal not in (".", ","):
            raise StudyError(f"--decimal is {self.decimal!r}; give '.' or ','")
        if separator == self.decimal:
            raise StudyError(
                f"cells and decimals are both marked by {separator!r}; "
                "choose another --separator, such as ';'"
            )


def write_csv(result: Result, columns: Mapping[str, Array], dialect: Dialect) -> str:
    """Columns with units; what they are stands in comments above."""
    text = io.StringIO()
    writer = csv.writer(text, delimiter=dialect.separator, lineterminator="\r\n")
    if dialect.header:
        text.writelines(f"# {line}\n" for line in flat(about(result)))
        writer.writerow(f"{name} [{result.arrays[name].unit}]" for name in columns)

    for row in zip(*(values.tolist() for values in columns.values()), strict=True):
        # an empty cell where a quantity is not defined: readers differ in what they take for nan
        cells = ("" if value != value else repr(value) for value in row)
        writer.writerow(cell.replace(".", dialect.decimal) for cell in cells)
    return text.getvalue()


def read_csv(text: str, dialect: Dialect) -> dict[str, Array]:
    """Read what `write_csv` wrote; columns are numbered where there is no header."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    rows = list(csv.reader(lines, delimiter=dialect.separator))
    names = [name.split(" [")[0] for name in rows.pop(0)] if dialect.header else None
    table = [[float(cell.replace(",", ".") or "nan") for cell in row] for row in rows]
    columns = np.array(table).T
    return dict(zip(names or map(str, range(len(columns))), columns, strict=True))


def write_json(result: Result, columns: Mapping[str, Array]) -> str:
    """JSON that keeps to `profile.schema.json`."""
    described = {
        name: {"unit": result.arrays[name].unit, "values": values.tolist()}
        for name, values in columns.items()
    }
    content = plain({**about(result), "columns": described})
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def read_json(text: str) -> dict[str, Array]:
    """Columns of what `write_json` wrote."""
    columns = json.loads(text)["columns"]
    return {name: np.array(item["values"], dtype=float) for name, item in columns.items()}


def write_mat(result: Result, columns: Mapping[str, Array]) -> bytes:
    """A MATLAB file of version 5: a vector a column, and the structs `units` and `about`."""
    from scipy.io import savemat

    content: dict[str, Any] = {name[:MATLAB_NAME]: values for name, values in columns.items()}
    content["units"] = {name[:MATLAB_NAME]: result.arrays[name].unit for name in columns}
    content["about"] = "\n".join(flat(about(result)))
    file = io.BytesIO()
    savemat(file, content, oned_as="column", do_compression=True)
    return file.getvalue()


def read_mat(content: bytes) -> dict[str, Array]:
    """Columns of what `write_mat` wrote."""
    from scipy.io import loadmat

    loaded = loadmat(io.BytesIO(content))
    return {
        name: np.ravel(values)
        for name, values in loaded.items()
        if not name.startswith("__") and name not in ("units", "about")
    }


def write_parquet(result: Result, columns: Mapping[str, Array]) -> bytes:
    """An Apache Parquet file with the units in the metadata of its columns.

    Raises
    ------
    StudyError
        If pyarrow is not installed.
    """
    arrow, parquet = _arrow()
    fields = [
        arrow.field(name, arrow.float64(), metadata={"unit": result.arrays[name].unit})
        for name in columns
    ]
    schema = arrow.schema(fields, metadata={"about": "\n".join(flat(about(result)))})
    table = arrow.table([arrow.array(values) for values in columns.values()], schema=schema)
    file = io.BytesIO()
    parquet.write_table(table, file)
    return file.getvalue()


def read_parquet(content: bytes) -> dict[str, Array]:
    """Columns of what `write_parquet` wrote."""
    _, parquet = _arrow()
    table = parquet.read_table(io.BytesIO(content))
    return {name: table[name].to_numpy() for name in table.column_names}


def _arrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise StudyError(
            "parquet needs the package pyarrow; install it with pip install 'antenna-ocp[parquet]'"
        ) from error
    return pyarrow, pyarrow.parquet
