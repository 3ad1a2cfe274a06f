"""Flags that state one key of a study each, on top of its file."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

KeyFlags = Mapping[str, tuple[tuple[str, ...], str]]
"""By flag, as `--force-cap`: the key's place in the study, and what `--help` says."""


def add_key_flags(parser: argparse.ArgumentParser, flags: KeyFlags) -> None:
    """Let a command take the flags."""
    for flag, (_, text) in flags.items():
        parser.add_argument(flag, metavar="X", help=text)


def put_key_flags(raw: dict[str, Any], options: argparse.Namespace, flags: KeyFlags) -> None:
    """Set the keys of the flags that were given; what spells a number is one.

    Raises
    ------
    StudyError
        If the file has a plain value where a table has to be.
    """
    from studies.common.configuration import as_number, put  # loads the schema library

    for flag, (place, _) in flags.items():
        text = getattr(options, flag.removeprefix("--").replace("-", "_"))
        if text is not None:
            put(raw, place, as_number(text))
