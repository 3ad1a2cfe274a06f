"""`antenna-ocp completion`: the script by which a shell completes sub-commands, flags and words."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from studies import registry
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.key_flags import key_flags
from studies.common.keys import file_schema
from studies.common.study import Command, Study

COMMAND = Command(
    "a script for the shell that completes sub-commands and flags",
    "studies.completion",
    "Prints a script by which bash or zsh completes sub-commands, flags, their words "
    "and names of files. "
    'bash: eval "$(antenna-ocp completion bash)". zsh: write it into a file _antenna-ocp in a '
    "folder of $fpath.",
)
SHELLS = ("bash", "zsh")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument("shell", choices=SHELLS, help=" or ".join(SHELLS))


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Print the script.

    Raises
    ------
    StudyError
        If the package that writes it is not installed.
    """
    try:
        import shtab
    except ImportError as error:
        raise StudyError(
            "completion needs shtab, which is not installed; install it with: "
            "pip install 'antenna-ocp[completion]'"
        ) from error

    parser = whole_parser()
    for one in _parsers(parser):
        for action in one._actions:
            if action.type is Path or action.metavar in ("FILE", "DIR"):
                action.complete = shtab.FILE  # type: ignore[attr-defined]
    console.say(shtab.complete(parser, options.shell))
    return ExitCode.OK


def whole_parser() -> argparse.ArgumentParser:
    """All sub-commands in one parser, as a shell's script needs them."""
    from studies.cli import PROGRAM, add_arguments_of

    parser = argparse.ArgumentParser(PROGRAM)
    groups: dict[str, Any] = {"": parser.add_subparsers()}
    for name in registry.names():
        group, _, last = name.rpartition(" ")
        if group not in groups:
            groups[group] = groups[""].add_parser(group, help=f"{group} of what").add_subparsers()
        one = groups[group].add_parser(last, help=registry.summary(name).replace("%", "%%"))
        add_arguments_of(name, one)
        if isinstance(study := registry.command(name), Study):
            _offer_words(one, study)
    return parser


def _offer_words(parser: argparse.ArgumentParser, study: Study) -> None:
    """Let the flags of keys that take one of several words offer these words."""
    schema = file_schema(study.tables(), study.name)
    for one in key_flags(study.tables(), study.without):
        value: Mapping[str, Any] = schema
        for key in one.place:
            value = value.get("properties", {}).get(key, {})
        action = parser._option_string_actions.get(one.flag.name)  # not every command has all
        if action is not None:
            action.choices = _words(value) or None


def _words(schema: Mapping[str, Any]) -> list[str]:
    """The words that a value may be, alone or first in a list."""
    inner = [*schema.get("anyOf", ()), *([schema["items"]] if "items" in schema else ())]
    return [*schema.get("enum", ()), *(word for one in inner for word in _words(one))]


def _parsers(parser: argparse.ArgumentParser) -> list[argparse.ArgumentParser]:
    """A parser and all those of its sub-commands."""
    found = [parser]
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for one in action.choices.values():
                found += _parsers(one)
    return found
