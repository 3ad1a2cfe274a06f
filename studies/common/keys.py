"""The keys of a configuration as a table of names, units, defaults and meanings, and as a schema.

Both come from the fields of its class. A class of the models, whose fields are no keys, says in its
docstring what they are.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from studies.common.configuration import Described, Key, toml_value

SECTION = re.compile(r"^(?:Attributes|Parameters)\n-+\n(.*?)(?=\n\n\S[^\n]*\n-+\n|\Z)", re.M | re.S)
FIELD = re.compile(r"^(\w+(?:, \w+)*) : (.*(?:\n[ ]+.*)*)", re.M)
UNIT = re.compile(r"\s*\[([^\]]+)\]")
DIALECT = "http://json-schema.org/draft-07/schema#"


@dataclass(frozen=True)
class KeyLine:
    """One line of a table of keys."""

    key: str
    unit: str
    default: str
    meaning: str


def key_lines(kind: type[Any], where: str = "", deep: bool = False) -> list[KeyLine]:
    """All keys of a configuration and of its sections, in order.

    Parameters
    ----------
    where : str
        Name of its table with a dot, such as "caps.".
    deep : bool
        Whether also to list what stands in tables that may be left out, in lists of tables, and in
        classes of the models. These have one line else: their own documentation lists the rest.
    """
    lines: list[KeyLine] = []
    for field in dataclasses.fields(kind):
        about = field.metadata.get("key")
        if about is None:
            model = type(default_of(field))
            lines.append(_of_a_model(kind, field, where))
            if deep and dataclasses.is_dataclass(model):
                lines += key_lines(model, f"{where}{field.name}.", deep)
            continue
        default, name = default_of(field), where + field.name
        if is_section(default):
            lines += key_lines(type(default), f"{name}.", deep)
            continue
        lines.append(KeyLine(name, about.unit, _shown(default), about.meaning))
        if deep and (inner := table_class(about)):
            lines += key_lines(inner, f"{name}.{'NAME.' if _is_named(about) else ''}", deep)
    return lines


def is_section(default: Any) -> bool:
    """Whether a default is a configuration of its own, whose fields are keys."""
    return dataclasses.is_dataclass(default) and all(
        "key" in inner.metadata for inner in dataclasses.fields(default)
    )


def default_of(field: dataclasses.Field[Any]) -> Any:
    """The default of a field; MISSING if it has none."""
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return field.default


def table_class(about: Key) -> type[Any] | None:
    """The class whose fields are the keys of the table that a key takes; None if it takes none."""
    read = about.read
    return read.table() if isinstance(read, Described) and read.table is not None else None


def _is_named(about: Key) -> bool:
    """Whether the tables of a key have names of the user's own."""
    return "additionalProperties" in about.read.schema  # type: ignore[attr-defined]


def _of_a_model(kind: type[Any], field: dataclasses.Field[Any], where: str) -> KeyLine:
    """The line of a field of the models."""
    text, default = field_texts(kind).get(field.name, ""), default_of(field)
    unit = (UNIT.findall(text) or [""])[0]
    meaning = UNIT.sub("", text, count=1).strip(" .,")
    return KeyLine(where + field.name, unit, _shown(default), meaning)


def field_texts(kind: type) -> dict[str, str]:
    """What the docstring of a class says of each field; empty if it lists none."""
    section = SECTION.search(inspect.getdoc(kind) or "")
    texts: dict[str, str] = {}
    for names, body in FIELD.findall(section[1] if section else ""):
        lines = [line.strip() for line in body.split("\n")]
        if len(lines) > 1 and re.fullmatch(r"[A-Z]?\w+", lines[0]):
            lines = lines[1:]  # "name : type" with the meaning below
        texts |= dict.fromkeys(names.split(", "), " ".join(lines))
    return texts


def _shown(default: Any) -> str:
    if default is dataclasses.MISSING:
        return "to be stated"
    if dataclasses.is_dataclass(default):
        return "a table"
    return "none" if default is None else toml_value(default)


def file_schema(
    tables: Mapping[str, type[Any]], title: str, without: Iterable[str] = ()
) -> dict[str, Any]:
    """The JSON Schema of a file of keys, by which an editor completes and checks it.

    Parameters
    ----------
    tables : mapping
        The class of the keys of each table; that of the keys above all tables has no name.
    without : iterable of str
        Keys above all tables that the file cannot have.
    """
    whole: dict[str, Any] = _table_schema(tables[""]) if "" in tables else {"properties": {}}
    for name, kind in tables.items():
        if name:
            whole["properties"][name] = _table_schema(kind)
    for name in without:
        whole["properties"].pop(name, None)
    if len(tables) > 1:  # what reads several tables may state a key itself
        whole.pop("required", None)
    return {"$schema": DIALECT, "title": title, **whole}


def _table_schema(kind: type[Any]) -> dict[str, Any]:
    fields = dataclasses.fields(kind)
    schema: dict[str, Any] = {
        "type": "object",
        "properties": dict(_properties(kind)),
        "additionalProperties": False,
    }
    required = [field.name for field in fields if default_of(field) is dataclasses.MISSING]
    return schema | ({"required": required} if required else {})


def _properties(kind: type[Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for field in dataclasses.fields(kind):
        about, default = field.metadata.get("key"), default_of(field)
        line = _of_a_model(kind, field, "") if about is None else about
        unit = f" [{line.unit}]" if line.unit else ""
        found: dict[str, Any] = {"description": f"{line.meaning}{unit}"}
        if about is not None:
            found |= _value_schema(about)
        elif isinstance(default, bool | int | float | str):
            found["type"] = {bool: "boolean", str: "string"}.get(type(default), "number")
        if isinstance(default, bool | int | float | str | tuple):
            found["default"] = default
        yield field.name, found


def _value_schema(about: Key) -> dict[str, Any]:
    """The schema of the values of a key."""
    if not isinstance(about.read, Described):
        return {}
    schema, kind = dict(about.read.schema), table_class(about)
    if kind is None:
        return schema
    inner = _table_schema(kind)
    if schema.get("type") == "array":
        return schema | {"items": inner}
    if _is_named(about):
        return schema | {"additionalProperties": inner}
    return inner | {"properties": inner["properties"] | schema.get("properties", {})}
