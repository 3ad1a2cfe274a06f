"""The whole profile as columns in binary files: MATLAB and Parquet."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

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


def write_parquet(
    result: Result, columns: Mapping[str, Array], first: Mapping[str, str] = NOTHING
) -> bytes:
    """An Apache Parquet file with the units in the metadata of its columns.

    Raises
    ------
    StudyError
        If pyarrow is not installed.
    """
    try:
        import pyarrow as arrow
        from pyarrow import parquet
    except ImportError as error:
        raise StudyError(
            "parquet needs the package pyarrow; install it with pip install 'antenna-ocp[parquet]'"
        ) from error

    fields = [
        arrow.field(name, arrow.float64(), metadata={"unit": result.arrays[name].unit})
        for name in columns
    ]
    schema = arrow.schema(fields, metadata={"about": _about(result, first)})
    table = arrow.table([arrow.array(values) for values in columns.values()], schema=schema)
    file = io.BytesIO()
    parquet.write_table(table, file)
    return file.getvalue()


def _about(result: Result, first: Mapping[str, str]) -> str:
    return "\n".join(comments(flat(about(result, first)), ""))
