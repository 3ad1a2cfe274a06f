"""Configurations: frozen dataclasses whose fields know their unit, meaning and range.

A field is declared by `key`, with a reader that turns what TOML, a flag or a caller gives into a
value, or raises one sentence with the key, the value and the remedy. Reading, checking, the list
of known keys and the table of the documentation all come from these fields.
"""

from __future__ import annotations

import dataclasses
import math
import numbers
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from studies.common.exit_codes import StudyError, quoted
from studies.common.foreign_text import parsed_toml

Reader = Callable[[str, Any], Any]  # from the key's full name and its value to the value meant
Configuration = TypeVar("Configuration")
Value = TypeVar("Value")

CLOSE_ENOUGH = 0.6  # similarity of words from which one is suggested for the other


@dataclass(frozen=True)
class Described(Generic[Value]):
    """A reader that says what it takes, for editors and tables.

    Attributes
    ----------
    read : as any reader.
    schema : of what it takes, in the words of JSON Schema.
    table : gives the class whose fields are the keys of the table that it takes; None if it takes
        no table.
    """

    read: Callable[[str, Any], Value]
    schema: Mapping[str, Any]
    table: Callable[[], type[Any]] | None = None

    def __call__(self, name: str, value: Any) -> Value:
        return self.read(name, value)


def describes(
    schema: Mapping[str, Any], table: Callable[[], type[Any]] | None = None
) -> Callable[[Callable[[str, Any], Value]], Described[Value]]:
    """Say of a reader what it takes; see `Described`."""
    return lambda read: Described(read, schema, table)


@dataclass(frozen=True)
class Flag:
    """How a command line states a key.

    Attributes
    ----------
    name : as it is typed, such as "--force-cap".
    below : the key in the table that is the key's value; empty for that value itself.
    meaning : for `--help`; the key's where it is empty.
    metavar : what stands for its value there.
    read : makes of the text that is typed what a file would state.
    value : what it states if it takes none.
    assigns : whether its value is NAME=VALUE, for any key of the table; it may be repeated.
    """

    name: str
    below: str = ""
    meaning: str = ""
    metavar: str = "X"
    read: Callable[[str], Any] = lambda text: as_number(text)
    value: Any = None
    assigns: bool = False


@dataclass(frozen=True)
class Key:
    """What is known of one key.

    Attributes
    ----------
    read : turns a raw value into the one meant.
    unit : SI unit or suffix unit; empty where it has none.
    meaning : in words, for the documentation.
    flags : that state it; of a section "--{}-cap" or the like, for the names of its keys; None
        for the flag with the key's own name.
    """

    read: Reader
    unit: str
    meaning: str
    flags: str | tuple[Flag, ...] | None = None


def key(
    read: Reader,
    unit: str,
    meaning: str,
    *,
    default: Any = dataclasses.MISSING,
    factory: Any = dataclasses.MISSING,
    flags: str | tuple[Flag, ...] | None = None,
) -> Any:
    """A field of a configuration; without `default` and `factory` it has to be stated."""
    about = {"key": Key(read, unit, meaning, flags)}
    if factory is not dataclasses.MISSING:
        return dataclasses.field(default_factory=factory, metadata=about)
    return dataclasses.field(default=default, metadata=about)


def optional_key(
    read: Reader, unit: str, meaning: str, flags: str | tuple[Flag, ...] | None = None
) -> Any:
    """A field that may be left out, and is None then."""
    return key(optional(read), unit, meaning, default=None, flags=flags)


def key_of(kind: type[Any], name: str) -> Any:
    """A field that is a key of another configuration, too: said once, and meant alike."""
    (field,) = (one for one in dataclasses.fields(kind) if one.name == name)
    return dataclasses.field(default=field.default, metadata=field.metadata)


def check(configuration: Any, where: str = "") -> None:
    """Read every field of a new configuration; for its `__post_init__`.

    Parameters
    ----------
    where : str
        Name of its section with a dot, such as "caps.", for the sentences.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    for field in dataclasses.fields(configuration):
        value = field.metadata["key"].read(where + field.name, getattr(configuration, field.name))
        object.__setattr__(configuration, field.name, value)


def from_mapping(
    kind: type[Configuration], raw: Mapping[str, Any], where: str = ""
) -> Configuration:
    """The configuration that a nested mapping states.

    Raises
    ------
    StudyError
        If a key is unknown or a value is wrong.
    """
    fields = dataclasses.fields(kind)  # type: ignore[arg-type]
    known = [field.name for field in fields]
    for field in fields:
        _refuse_keys_of_a_section(raw, known, field, where)
    check_keys(raw, known, where)
    for field in fields:
        without = field.default is field.default_factory is dataclasses.MISSING
        if without and field.name not in raw:
            unit = field.metadata["key"].unit
            raise StudyError(
                f"{where}{field.name} is not stated; give it{f' in {unit}' if unit else ''}"
            )
    return kind(**raw)


def _refuse_keys_of_a_section(
    raw: Mapping[str, Any], known: Sequence[str], field: dataclasses.Field[Any], where: str
) -> None:
    """StudyError at the first key that stands above the table that it belongs into."""
    about = field.metadata.get("key")
    read = None if about is None else about.read
    if not isinstance(read, Described) or read.table is None or set(raw) <= set(known):
        return
    if read.schema.get("type") == "array":  # of tables: which of them is meant?
        return
    inside = [one.name for one in dataclasses.fields(read.table())]
    for name in raw:
        if name in inside and name not in known:
            raise StudyError(
                f"{where}{name} is a key of {field.name}; write it below a line "
                f"[{where}{field.name}]"
            )


def check_keys(raw: Mapping[str, Any], known: Iterable[str], where: str = "") -> None:
    """Raise StudyError at the first key that is not known."""
    known = list(known)
    for name in raw:
        if name not in known:
            near = nearest(name, known)
            hint = f"did you mean {where}{near}?" if near else f"known are {', '.join(known)}"
            raise StudyError(f"unknown key {where}{name}; {hint}")


def nearest(word: str, known: Iterable[str]) -> str:
    """The known word of which `word` differs in few letters, or which alone it is a part of.

    Empty if there is none.
    """
    import difflib  # for errors only

    known = list(known)
    near = difflib.get_close_matches(word, known, n=1, cutoff=CLOSE_ENOUGH)
    longer = [one for one in known if len(word) > 2 and word in one]
    return next(iter([*near, *(longer if len(longer) == 1 else [])]), "")


def closest(word: str, known: Iterable[str], all_of_them: str = "choose one of") -> str:
    """The end of a sentence about an unknown word: the nearest known one, or all."""
    known = list(known)
    near = nearest(word, known)
    return f"did you mean {near}?" if near else f"{all_of_them} {', '.join(known)}"


@describes({"type": "number", "exclusiveMinimum": 0})
def positive(name: str, value: Any) -> float:
    """A finite number above zero."""
    if not (_is_finite(value) and value > 0):
        raise StudyError(f"{name} is {quoted(value)}; give a finite positive number")
    return float(value)


@describes({"type": "number", "minimum": 0})
def not_negative(name: str, value: Any) -> float:
    """A finite number of at least zero."""
    if not (_is_finite(value) and value >= 0):
        raise StudyError(f"{name} is {quoted(value)}; give a finite non-negative number")
    return float(value)


@describes({"type": "number"})
def finite(name: str, value: Any) -> float:
    """A finite number of either sign."""
    if not _is_finite(value):
        raise StudyError(f"{name} is {quoted(value)}; give a finite number")
    return float(value)


def part_below_one(remedy: str) -> Described[float]:
    """Reader of a number above zero and below one.

    Parameters
    ----------
    remedy : what to say of a larger one, behind "give a fraction below 1".
    """

    def read(name: str, value: Any) -> float:
        part = positive(name, value)
        if part >= 1.0:
            raise StudyError(f"{name} is {part:g}; give a fraction below 1{remedy}")
        return part

    return Described(read, {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1})


@describes({"type": "boolean"})
def boolean(name: str, value: Any) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        raise StudyError(f"{name} is {quoted(value)}; give true or false")
    return value


def _is_finite(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number of more than 308 digits
        return False


def whole(least: int, most: int | None = None) -> Reader:
    """Reader of a whole number between two limits."""

    def read(name: str, value: Any) -> int:
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        if not is_whole or value < least:
            raise StudyError(f"{name} is {quoted(value)}; give a whole number of at least {least}")
        if most is not None and value > most:
            raise StudyError(f"{name} is {quoted(value)}; give a whole number of at most {most}")
        return int(value)

    ends = {"minimum": least} | ({} if most is None else {"maximum": most})
    return Described(read, {"type": "integer", **ends})


@describes({"type": ["array", "string"], "items": {"type": "number"}})
def two_limits(name: str, value: Any) -> tuple[float, float]:
    """Reader of a lowest and a highest positive number, as a list or as LOW..HIGH."""
    stated = isinstance(value, str)
    ends = [as_number(end.strip()) for end in value.split("..")] if stated else value
    if not isinstance(ends, list | tuple) or len(ends) != 2:
        raise StudyError(f"{name} is {quoted(value)}; give LOW..HIGH, or [low, high] in a file")
    low, high = positive(name, ends[0]), positive(name, ends[1])
    if low >= high:
        raise StudyError(f"{name} is {low:g} to {high:g}; give the lower limit first")
    return low, high


def choice(names: Iterable[str]) -> Reader:
    """Reader of one of several words."""
    names = tuple(names)

    def read(name: str, value: Any) -> str:
        if value not in names:
            raise StudyError(f"{name} is {quoted(value)}; {closest(str(value), names)}")
        return str(value)

    return Described(read, {"enum": list(names)})


def choices(names: Iterable[str]) -> Reader:
    """Reader of a list out of several words."""
    names = tuple(names)
    one = choice(names)

    def read(name: str, value: Any) -> tuple[str, ...]:
        if isinstance(value, str) or not isinstance(value, Sequence) or not value:
            raise StudyError(f"{name} is {quoted(value)}; give a list out of {', '.join(names)}")
        return tuple(one(name, item) for item in value)

    return Described(read, {"type": "array", "items": {"enum": list(names)}})


def optional(read: Reader) -> Reader:
    """Reader that also takes None, and "none" where TOML has no such value."""

    def maybe(name: str, value: Any) -> Any:
        return None if value is None or value == "none" else read(name, value)

    if not isinstance(read, Described):
        return maybe
    schema = {"anyOf": [read.schema, {"const": "none"}]} if read.table is None else read.schema
    return Described(maybe, schema, read.table)


def section(kind: type[Any]) -> Reader:
    """Reader of a table that is a configuration of its own."""

    def read(name: str, value: Any) -> Any:
        if isinstance(value, kind):
            return value
        return from_mapping(kind, table(name, value), f"{name}.")

    return Described(read, {"type": "object"}, lambda: kind)


def table(name: str, value: Any) -> Mapping[str, Any]:
    """A table of TOML."""
    if not isinstance(value, Mapping):
        raise StudyError(f"{name} is {quoted(value)}; make it a table: [{name}]")
    return value


def read_toml(path: Path | None) -> dict[str, Any]:
    """Read a TOML file; no key is stated where no file is given.

    Raises
    ------
    StudyError
        If it cannot be read or is no TOML.
    """
    if path is None:
        return {}
    try:
        return parsed_toml(path.read_text("utf-8"))
    except OSError as error:
        raise StudyError(f"the file {path} cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise StudyError(
            f"the file {path} is not text in UTF-8 (from byte {error.start}); save it as UTF-8"
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"the file {path} is not valid TOML: {error}") from error
    except ValueError as error:
        raise StudyError(f"the file {path} is refused: {error}") from error


def put(raw: dict[str, Any], place: Sequence[str], value: Any) -> None:
    """Set a nested key, as a flag on top of a file does.

    Raises
    ------
    StudyError
        If the file has a plain value where a table has to be.
    """
    for name in place[:-1]:
        raw = raw.setdefault(name, {})
        if not isinstance(raw, dict):
            raise StudyError(f"{name} is {quoted(raw)} in the TOML file; make it a table: [{name}]")
    raw[place[-1]] = value


def with_commas(text: str) -> list[str]:
    """The words of a text that stand between commas."""
    return [word.strip() for word in text.split(",")]


def as_number(text: str) -> Any:
    """The number that `text` spells, or the text itself."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def as_stated(study: Any) -> dict[str, Any]:
    """The nested mapping that states a configuration again; TOML has no word for None."""
    return _without_none(dataclasses.asdict(study))


def _without_none(content: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: _without_none(value) if isinstance(value, Mapping) else value
        for name, value in content.items()
        if value is not None
    }


def toml_text(content: Mapping[str, Any], inline: Iterable[str] = ()) -> str:
    """A nested mapping as TOML; tables named in `inline` stay in one line."""
    return "\n".join(_toml_lines(content, frozenset(inline), "")) + "\n"


def _toml_lines(content: Mapping[str, Any], inline: frozenset[str], table: str) -> list[str]:
    tables = {k: v for k, v in content.items() if isinstance(v, Mapping) and k not in inline}
    lines = [f"{_toml_key(k)} = {toml_value(v)}" for k, v in content.items() if k not in tables]
    for name, value in tables.items():
        full = f"{table}.{_toml_key(name)}" if table else _toml_key(name)
        lines += ["", f"[{full}]", *_toml_lines(value, inline, full)]
    return lines


def _toml_key(name: str) -> str:
    """A name as a key; one with other signs than letters, digits, - and _ is quoted."""
    bare = re.fullmatch(r"[A-Za-z0-9_-]+", name) is not None
    return name if bare else toml_value(name)


def toml_value(value: Any) -> str:
    """A value as TOML writes it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    if isinstance(value, Mapping):
        return (
            "{ " + ", ".join(f"{_toml_key(k)} = {toml_value(v)}" for k, v in value.items()) + " }"
        )
    return repr(value)
