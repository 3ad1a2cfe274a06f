"""`antenna-ocp keys`: the keys of a study's file with units, defaults and meanings, or a schema."""

from __future__ import annotations

import argparse
import json
import textwrap

from studies import registry
from studies.common.configuration import closest
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.key_flags import key_flags
from studies.common.keys import KeyLine, file_schema, key_lines
from studies.common.study import Command, Study

COMMAND = Command(
    "the keys of a study's file: names, units, defaults, meanings; or their JSON Schema",
    "studies.keys",
    "Lists all keys that the file of a study may have. The schema lets an editor complete keys and "
    "check them while they are typed.",
)
WIDTH, WIDEST = 100, 15  # of a line, and of a default in it, in characters


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument(
        "study", nargs="+", metavar="STUDY", help="words of its command, as: truss, or arm solve"
    )
    parser.add_argument(
        "--schema", action="store_true", help="print the JSON Schema of the file instead"
    )


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Print the keys of a study."""
    study = _study(" ".join(options.study))
    tables = study.tables()
    if options.schema:
        title = f"A study of antenna-ocp {study.name}"
        console.say(
            json.dumps(file_schema(tables, title, study.without), indent=2, ensure_ascii=False)
        )
        return ExitCode.OK
    console.say(keys_text(study))
    return ExitCode.OK


def _study(name: str) -> Study:
    """The study of that name, which has a file with keys."""
    try:
        return registry.study_named(name)
    except KeyError:
        known = [study.name for study in registry.studies()]
        raise StudyError(f"there is no study '{name}'; {closest(name, known)}") from None


def keys_text(study: Study) -> str:
    """All keys of a study in columns, below the tables that they stand in."""
    flags = {one.dest: one.flag.name for one in key_flags(study.tables(), study.without)}
    by_table: dict[str, list[KeyLine]] = {"": []}
    for table, kind in study.tables().items():
        for line in key_lines(kind, f"{table}." if table else "", deep=True):
            if line.key not in study.without:
                by_table.setdefault(line.key.rpartition(".")[0], []).append(line)

    head = KeyLine("key", "unit", "default", "meaning (flag)")
    shown = [head, *(line for lines in by_table.values() for line in lines)]
    widths = (
        max(len(line.key.rpartition(".")[2]) for line in shown),
        max(len(line.unit) for line in shown),
    )
    text = [_row(head, "", widths)]
    for table, lines in by_table.items():
        text += ["", f"[{table}]"] if table else []
        text += [_row(line, flags.get(line.key, ""), widths) for line in lines]
    return "\n".join(text)


def _row(line: KeyLine, flag: str, widths: tuple[int, int]) -> str:
    """A key in columns; its meaning goes on below where it is long."""
    name, (wide, units) = line.key.rpartition(".")[2], widths
    default = line.default if len(line.default) <= WIDEST else "..."
    meaning = line.meaning + ("" if default == line.default else f"; default {line.default}")
    begun = f"{name:<{wide}}  {line.unit:<{units}}  {default:<{WIDEST}}  "
    return textwrap.fill(
        f"{meaning} ({flag})" if flag else meaning,
        WIDTH,
        initial_indent=begun,
        subsequent_indent=" " * len(begun),
        break_on_hyphens=False,
    )
