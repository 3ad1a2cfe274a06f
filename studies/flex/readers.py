"""Readers of the values of a case: lists, lists of tables, areas and factors."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from studies.common.configuration import (
    Described,
    Reader,
    as_number,
    describes,
    finite,
    from_mapping,
    table,
    with_commas,
)
from studies.common.exit_codes import StudyError, quoted
from studies.common.sizes import between, limited

AREA, SECOND_MOMENT = between(1e-12, 1e6), between(1e-24, 1e12)  # [m^2], [m^4]
FACTOR = between(1e-4, 1e4)


def numbers(least: int = 0, most: int | None = None) -> Reader:
    """Reader of a list of finite numbers."""

    def read(name: str, value: Any) -> tuple[float, ...]:
        if isinstance(value, str) or not isinstance(value, Sequence) or len(value) < least:
            raise StudyError(f"{name} is {quoted(value)}; give a list of {least} or more numbers")
        if most is not None and len(value) > most:
            raise StudyError(f"{name} has {len(value)} numbers; give at most {most}")
        return tuple(limited(finite)(f"{name}[{i}]", item) for i, item in enumerate(value))

    ends = {"minItems": least} | ({} if most is None else {"maxItems": most})
    return Described(read, {"type": "array", "items": {"type": "number"}, **ends})


def numbers_with_commas(text: str) -> list[Any]:
    """The numbers of a text that stand between commas."""
    return [as_number(word) for word in with_commas(text)]


def tables(kind: type[Any]) -> Reader:
    """Reader of a list of tables, each a configuration of its own."""

    def read(name: str, value: Any) -> tuple[Any, ...]:
        if isinstance(value, str | Mapping) or not isinstance(value, Sequence) or not value:
            raise StudyError(f"there is no {name}; give one or more tables [[{name}]]")
        return tuple(_stated_table(kind, f"{name}[{i}]", item) for i, item in enumerate(value))

    return Described(read, {"type": "array", "minItems": 1}, lambda: kind)


def named_tables(kind: type[Any]) -> Reader:
    """Reader of tables with names of the user's own."""

    def read(name: str, value: Any) -> dict[str, Any]:
        items = table(name, value).items()
        return {key: _stated_table(kind, f"{name}.{key}", item) for key, item in items}

    return Described(read, {"type": "object", "additionalProperties": True}, lambda: kind)


def _stated_table(kind: type[Any], name: str, value: Any) -> Any:
    """A configuration out of one of several tables; its sentences name which one."""
    if isinstance(value, kind):
        return value
    raw = table(name, value)
    for field in dataclasses.fields(kind):
        optional_field = field.default is not dataclasses.MISSING
        if not optional_field and field.name not in raw:
            unit = field.metadata["key"].unit
            raise StudyError(f"{name} has no {field.name}; give one in {unit}")
    try:
        return from_mapping(kind, raw, f"{name}.")
    except StudyError as error:
        kind_name = name.split("[")[0].split(".")[0]
        text = str(error).removeprefix(f"{kind_name}.")
        if text == str(error):
            raise
        raise StudyError(f"{name}.{text}") from error


@describes({"type": "string"})
def text(name: str, value: Any) -> str:
    """A text."""
    if not isinstance(value, str):
        raise StudyError(f"{name} is {quoted(value)}; give a text")
    return value
