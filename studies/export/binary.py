"""The whole profile as columns in binary files: MATLAB and Parquet."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np

from ocp.arrays import Array
from studies.common.columns import NOTHING, about, flat
from studies.common.exit_codes import StudyError
from studies.common.headers import comments
from studies.common.result import Result

MATLAB_NAME = 31  # letters of a name that every version of MATLAB reads


def write_mat(
    result: Result, columns: Mapping[str, Array], first: Mapping[str, str] = NOTHING
) -> bytes:
    """A MATLAB file of version 5: a vector a column, and the structs `units` and `about`."""
    from scipy.io import savemat

    content: dict[str, Any] = {name[:MATLAB_NAME]: values for name, values in columns.items()}
    content["units"] = {name[:MATLAB_NAME]: result.arrays[name].unit for name in columns}
    content["about"] = _about(result, first)
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


def write_parquet(
    result: Result, columns: Mapping[str, Array], first: Mapping[str, str] = NOTHING
) -> bytes:
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
    schema = arrow.schema(fields, metadata={"about": _about(result, first)})
    table = arrow.table([arrow.array(values) for values in columns.values()], schema=schema)
    file = io.BytesIO()
    parquet.write_table(table, file)
    return file.getvalue()


def read_parquet(content: bytes) -> dict[str, Array]:
    """Columns of what `write_parquet` wrote."""
    _, parquet = _arrow()
    table = parquet.read_table(io.BytesIO(content))
    return {name: table[name].to_numpy() for name in table.column_names}


def _about(result: Result, first: Mapping[str, str]) -> str:
    return "\n".join(comments(flat(about(result, first)), ""))


def _arrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise StudyError(
            "parquet needs the package pyarrow; install it with pip install 'antenna-ocp[parquet]'"
        ) from error
    return pyarrow, pyarrow.parquet
