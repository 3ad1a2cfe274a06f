"""Columns as CSV, JSON, MATLAB and Parquet come back as they were written."""

import io
import json
from pathlib import Path

import numpy as np
import pytest

from studies.common import columns as text
from studies.common.columns import Dialect
from studies.common.result import Result
from studies.export import binary
from tests.studies.export.command_line import read_mat
from tests.studies.written_columns import read_csv, read_json


@pytest.mark.parametrize(
    "dialect", [Dialect(), Dialect(";", ","), Dialect("tab"), Dialect(";", ".", header=False)]
)
def test_csv_comes_back_in_each_dialect(short: Result, dialect: Dialect) -> None:
    columns = {name: short.arrays[name].values for name in ("time", "angle", "angular_jerk")}
    again = read_csv(text.write_csv(short, columns, dialect), dialect)
    for found, exact in zip(again.values(), columns.values(), strict=True):
        assert np.array_equal(found, exact)


def test_matlab_and_json_come_back(short: Result) -> None:
    columns = {name: short.arrays[name].values for name in ("time", "rope_length")}
    for again in (
        read_mat(binary.write_mat(short, columns)),
        read_json(text.write_json(short, columns)),
    ):
        assert all(np.array_equal(again[name], columns[name]) for name in columns)


def test_parquet_comes_back(short: Result) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is an extra")
    columns = {name: short.arrays[name].values for name in ("time", "rope_length")}
    again = parquet.read_table(io.BytesIO(binary.write_parquet(short, columns)))
    assert all(np.array_equal(again[name].to_numpy(), columns[name]) for name in columns)


def meets(value: object, schema: dict[str, object]) -> bool:
    """Whether JSON keeps to a schema, as far as ours goes: types, keys, items."""
    kinds = {
        "object": dict,
        "array": list,
        "string": str,
        "number": (int, float),
        "null": type(None),
    }
    stated = schema.get("type", list(kinds))
    allowed = stated if isinstance(stated, list) else [stated]
    if not any(isinstance(value, kinds[str(name)]) for name in allowed):
        return False

    if isinstance(value, list):
        items = schema.get("items", {})
        assert isinstance(items, dict)
        return len(value) >= int(str(schema.get("minItems", 0))) and all(
            meets(item, items) for item in value
        )
    if not isinstance(value, dict):
        return True

    known, further = schema.get("properties", {}), schema.get("additionalProperties", True)
    required = schema.get("required", [])
    assert isinstance(known, dict)
    assert isinstance(required, list)
    if not set(required) <= set(value):
        return False
    for name, item in value.items():
        inner = known.get(name, further)
        if inner is False or (isinstance(inner, dict) and not meets(item, inner)):
            return False
    return True


def test_json_keeps_to_the_published_schema(short: Result) -> None:
    schema = json.loads((Path(text.__file__).parent / "profile.schema.json").read_text("utf-8"))
    profile = json.loads(text.write_json(short, {"time": short.arrays["time"].values}))
    assert meets(profile, schema)
    assert not meets(profile | {"columns": {}}, schema)
    profile["columns"]["time"]["values"] = ["0"]
    assert not meets(profile, schema)
