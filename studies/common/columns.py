"""Series of a result as columns of text: CSV in any dialect, and JSON with a schema."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from ocp.arrays import Array
from studies.common.exit_codes import StudyError, quoted
from studies.common.folder import plain
from studies.common.headers import SEPARATORS, cell, comments
from studies.common.result import Result

NOTHING: Mapping[str, str] = MappingProxyType({})


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
                f"--separator is {quoted(self.separator)}; give one sign such as ',' ';' or tab"
            )
        if self.decimal not in (".", ","):
            raise StudyError(f"--decimal is {quoted(self.decimal)}; give '.' or ','")
        if separator == self.decimal:
            raise StudyError(
                f"cells and decimals are both marked by {separator!r}; "
                "choose another --separator, such as ';'"
            )


def about(result: Result, first: Mapping[str, str] = NOTHING) -> dict[str, Any]:
    """What an export says of itself, before its columns; `first` comes before all else."""
    return {
        **first,
        # where the table sets several laws side by side, the profile may be another motion's
        "law": result.details.get("profile_of", next(iter(result.laws), "")),
        "question": result.question,
        "study": result.configuration,
        "verdict": result.verdict.sentence,
        **{k: v for k, v in result.details.items() if k == "how_to_read"},
        "accuracy": result.details.get("accuracy", {}),
        "made_by": result.provenance,
    }


def stored_columns(result: Result) -> dict[str, Array]:
    """The series along the main axis, as they are stored."""
    return {
        name: series.values for name, series in result.arrays.items() if series.axis == result.axis
    }


def write_csv(
    result: Result,
    columns: Mapping[str, Array],
    dialect: Dialect | None = None,
    first: Mapping[str, str] = NOTHING,
) -> str:
    """Columns with units; what they are stands in comments above.

    Parameters
    ----------
    result : Result
        Of which the columns are.
    columns : (m,) each, by names of its series.
    dialect : Dialect, optional
        Commas between cells and decimal points by default.
    first : mapping
        Comments above all others.
    """
    dialect = dialect or Dialect()
    text = io.StringIO()
    writer = csv.writer(text, delimiter=dialect.separator, lineterminator="\r\n")
    if dialect.header:
        for line in comments(flat(about(result, first))):
            if dialect.separator in SEPARATORS:
                text.write(f"{line}\n")
            else:  # a space, say: one cell, in quotes
                writer.writerow([line])
        writer.writerow(cell(f"{name} [{result.arrays[name].unit}]") for name in columns)

    for row in zip(*(values.tolist() for values in columns.values()), strict=True):
        # an empty cell where a quantity is not defined: readers differ in what they take for nan
        cells = ("" if value != value else repr(value) for value in row)
        writer.writerow(cell.replace(".", dialect.decimal) for cell in cells)
    return text.getvalue()


def write_json(
    result: Result, columns: Mapping[str, Array], first: Mapping[str, str] = NOTHING
) -> str:
    """JSON that keeps to `profile.schema.json` beside this file."""
    described = {
        name: {"unit": result.arrays[name].unit, "values": values.tolist()}
        for name, values in columns.items()
    }
    content = plain({**about(result, first), "columns": described})
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def flat(content: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """The values of a nested mapping, with dots between the keys."""
    found: dict[str, Any] = {}
    for key, value in content.items():
        if isinstance(value, Mapping):
            found |= flat(value, f"{prefix}{key}.")
        else:
            found[f"{prefix}{key}"] = value
    return found
