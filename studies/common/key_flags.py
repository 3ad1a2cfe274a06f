"""Flags that state one key of a study each, on top of its file.

The `dest` of such a flag is the key with its tables, as `caps.force`, so that a sentence about the
key can name the flag that was typed.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Mapping
from typing import Any

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError

Run = Callable[[argparse.Namespace, Console], ExitCode]
KeyFlags = Mapping[str, tuple[tuple[str, ...], str]]
"""By flag, as `--force-cap`: the key's place in the study, and what `--help` says."""


def add_key_flags(parser: argparse.ArgumentParser, flags: KeyFlags) -> None:
    """Let a command take the flags."""
    for flag, (place, text) in flags.items():
        parser.add_argument(flag, dest=".".join(place), metavar="X", help=text)


def put_key_flags(raw: dict[str, Any], options: argparse.Namespace, flags: KeyFlags) -> None:
    """Set the keys of the flags that were given; what spells a number is one.

    Raises
    ------
    StudyError
        If the file has a plain value where a table has to be.
    """
    from studies.common.configuration import as_number, put  # loads the schema library

    for place, _ in flags.values():
        text = getattr(options, ".".join(place))
        if text is not None:
            put(raw, place, as_number(text))


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
