"""Reads what `studies.common.columns` wrote."""

from __future__ import annotations

import csv
import json

import numpy as np

from ocp.arrays import Array
from studies.common.columns import Dialect


def read_csv(text: str, dialect: Dialect) -> dict[str, Array]:
    """Read what `write_csv` wrote; columns are numbered where there is no header."""
    lines = [line for line in text.splitlines() if not line.startswith(("#", '"#'))]
    rows = list(csv.reader(lines, delimiter=dialect.separator))
    names = [name.split(" [")[0] for name in rows.pop(0)] if dialect.header else None
    table = [[float(cell.replace(",", ".") or "nan") for cell in row] for row in rows]
    columns = np.array(table).T
    return dict(zip(names or map(str, range(len(columns))), columns, strict=True))


def read_json(text: str) -> dict[str, Array]:
    """Columns of what `write_json` wrote."""
    columns = json.loads(text)["columns"]
    return {name: np.array(item["values"], dtype=float) for name, item in columns.items()}
