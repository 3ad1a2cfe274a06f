"""The parameters of the model of a result, as a report lists them: meaning, unit, value, source."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class ParameterLine:
    """One parameter: what it is called, what it is, and where its value comes from."""

    name: str
    meaning: str
    unit: str
    value: Any
    source: str


def stated_parameters(
    kind: type,
    values: Mapping[str, Any],
    prefix: str = "",
    sources: tuple[str, str] = ("by default", "stated in this case"),
) -> list[ParameterLine]:
    """What a table of keys states; tables inside it are left out.

    Parameters
    ----------
    kind : class of the keys.
    values : by key; those that are not there have no line.
    prefix : before each name.
    sources : of a value that is the default, and of another one.
    """
    lines = []
    for field in dataclasses.fields(kind):
        value, about = values.get(field.name), field.metadata.get("key")
        if about is None or value is None or isinstance(value, Mapping):
            continue
        source = sources[value != field.default]
        if isinstance(value, (list, tuple)):
            if not value or isinstance(value[0], Mapping):
                continue
            value = ", ".join(f"{one:g}" if isinstance(one, float) else str(one) for one in value)
        name = prefix + in_words(field.name)
        lines.append(ParameterLine(name, about.meaning, about.unit or "-", value, source))
    return lines


def in_words(name: str) -> str:
    """The name of a field as words."""
    return name.replace("_", " ")
