"""Flags that state keys of a study, on top of its file: they come from the keys themselves.

The `dest` of such a flag is the key with its tables, as `caps.force`, so that a sentence about the
key can name the flag that was typed.
"""

from __future__ import annotations

import argparse
import dataclasses
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from studies.common.configuration import Flag, Key, as_number, put
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError, quoted
from studies.common.keys import default_of, is_section

Run = Callable[[argparse.Namespace, Console], ExitCode]
OWN_NAME = "--{}"


@dataclass(frozen=True)
class KeyFlag:
    """A flag and the key that it states.

    Attributes
    ----------
    flag : how it is typed.
    place : the key with the tables above it, from the outside in.
    group : title of the keys that `--help` lists together.
    text : what `--help` says of it.
    """

    flag: Flag
    place: tuple[str, ...]
    group: str
    text: str

    @property
    def dest(self) -> str:
        """Where a parser puts what was typed."""
        return ".".join(self.place) + (".*" if self.flag.assigns else "")


def key_flags(tables: Mapping[str, type[Any]], without: Iterable[str] = ()) -> list[KeyFlag]:
    """The flags of all keys.

    Parameters
    ----------
    tables : mapping
        The class of the keys of each table; that of the keys above all tables has no name.
    without : iterable of str
        Keys that no flag states.
    """
    found: dict[str, KeyFlag] = {}
    left_out = set(without)
    for table, kind in tables.items():
        for one in _flags_of(kind, (table,) if table else (), "", OWN_NAME):
            if left_out & {".".join(one.place), one.place[0]}:
                continue
            name = one.flag.name
            if name in found:  # two tables have a key of that name: the later one says its table
                name = f"--{'-'.join(one.place)}".replace("_", "-")
            found[name] = dataclasses.replace(one, flag=dataclasses.replace(one.flag, name=name))
    return list(found.values())


def _flags_of(
    kind: type[Any], above: tuple[str, ...], group: str, pattern: str
) -> Iterator[KeyFlag]:
    title = group or (f"[{'.'.join(above)}]" if above else "")
    for field in dataclasses.fields(kind):
        about, place = field.metadata["key"], (*above, field.name)
        made = field.default_factory is not dataclasses.MISSING and isinstance(about.flags, tuple)
        default = None if made else default_of(field)  # what makes it may load the models
        if is_section(default):
            of_a_section = about.flags if isinstance(about.flags, str) else OWN_NAME
            head = f"[{'.'.join(place)}], {about.meaning}"
            yield from _flags_of(type(default), place, head, of_a_section)
            continue
        for flag in _flags_of_key(field.name, about, default, pattern):
            whole = (*place, *flag.below.split(".")) if flag.below else place
            in_table = f"[{'.'.join(place)}], {about.meaning.partition(';')[0]}"
            inside = bool(flag.below or flag.assigns)
            text = _help(flag, about, default)
            yield KeyFlag(flag, whole, in_table if inside else title, text)


def _help(flag: Flag, about: Key, default: Any) -> str:
    text = flag.meaning or f"{about.meaning}{f' [{about.unit}]' if about.unit else ''}"
    if default is True:
        return f"off: {text}"
    if flag.below or flag.value is not None or not isinstance(default, int | float | str):
        return text
    return f"{text}; default {default if isinstance(default, str) else f'{default:g}'}"


def _flags_of_key(name: str, about: Key, default: Any, pattern: str) -> tuple[Flag, ...]:
    if isinstance(about.flags, tuple):
        return about.flags
    typed = name.replace("_", "-")
    if isinstance(default, bool):  # what is off unless it is said takes no value, nor what is on
        return (Flag(pattern.format(f"no-{typed}" if default else typed), value=not default),)
    return (Flag(pattern.format(typed)),)


def add_key_flags(parser: argparse.ArgumentParser, flags: Iterable[KeyFlag]) -> None:
    """Let a command take the flags, in groups by their tables."""
    groups: dict[str, argparse._ActionsContainer] = {"": parser}
    for one in flags:
        if one.group not in groups:
            groups[one.group] = parser.add_argument_group(one.group)
        how: dict[str, Any] = {"metavar": one.flag.metavar}
        if one.flag.value is not None:
            how = {"action": "store_const", "const": one.flag.value}
        elif one.flag.assigns:
            how |= {"action": "append"}
        text = one.text.replace("%", "%%")
        groups[one.group].add_argument(one.flag.name, dest=one.dest, help=text, **how)


def put_key_flags(
    raw: dict[str, Any], options: argparse.Namespace, flags: Iterable[KeyFlag]
) -> None:
    """Set the keys of the flags that were given.

    Raises
    ------
    StudyError
        If the file has a plain value where a table has to be, or two flags state the same key.
    """
    flags = list(flags)
    for one in flags:
        typed = getattr(options, one.dest)
        if typed is None:
            continue
        if one.flag.assigns:
            _put_assignments(raw, one, typed, {f.dest: f.flag.name for f in flags}, options)
        elif one.flag.value is not None:
            put(raw, one.place, typed)
        else:
            put(raw, one.place, one.flag.read(typed))


def _put_assignments(
    raw: dict[str, Any],
    one: KeyFlag,
    typed: Iterable[str],
    names: Mapping[str, str],
    options: argparse.Namespace,
) -> None:
    """Set keys of a table by NAME=VALUE; one that is stated twice is refused."""
    stated: dict[str, str] = {}
    for assignment in typed:
        name, equals, text = (part.strip() for part in assignment.partition("="))
        if not (name and equals and text):
            raise StudyError(
                f"{one.flag.name} is {quoted(assignment)}; write NAME=VALUE, e.g. link=0.16"
            )

        # an angle may be stated in radians and in degrees
        same = (name, f"{name}_deg", name.removesuffix("_deg"))
        first = next((f"{one.flag.name} {n}={stated[n]}" for n in same if n in stated), "")
        dest = ".".join((*one.place, name))
        if not first and getattr(options, dest, None) is not None:
            first = f"{names[dest]} {getattr(options, dest)}"
        if first:
            raise StudyError(
                f"{first} and {one.flag.name} {name}={text} state the same thing; leave one of "
                "them out"
            )

        stated[name] = text
        table = raw.get(one.place[0])
        if isinstance(table, dict):  # the flag overrides the file, in whichever unit
            for other in set(same) - {name}:
                table.pop(other, None)
        put(raw, (*one.place, *name.split(".")), as_number(text))


def typed_flags(parser: argparse.ArgumentParser, options: argparse.Namespace) -> dict[str, str]:
    """The flags that were typed, by what they state."""
    return {
        action.dest: action.option_strings[-1]
        for action in parser._actions
        if action.option_strings
        and getattr(options, action.dest, action.default) != parser.get_default(action.dest)
    }


def with_flags_named(run: Run, typed: Mapping[str, str]) -> Run:
    """A run whose errors name the flags that were typed, and not the keys that these state."""

    def named(options: argparse.Namespace, console: Console) -> ExitCode:
        try:
            return run(options, console)
        except StudyError as error:
            raise StudyError(_in_flags(str(error), typed), error.exit_code) from error

    return named


def _in_flags(sentence: str, typed: Mapping[str, str]) -> str:
    """A sentence about keys of a study, with the flags that were typed in their place.

    A key without its table, as `duration`, is an everyday word, too: it is a key if the sentence
    begins with it and says its value.
    """
    for key, flag in typed.items():
        last = re.escape(key.split(".")[-1])
        sentence = re.sub(rf"^{last}(?= (is|runs|states) )", flag, sentence)
        if "." in key:
            sentence = re.sub(rf"(?<![\w.]){re.escape(key)}(?!\.?\w)", flag, sentence)
    return sentence
