"""The command `antenna-ocp`: finds the sub-command, turns errors into one sentence and a code.

Sub-commands are those of `studies.registry`.
"""

from __future__ import annotations

import argparse
import importlib
import os
import re
import sys
import tempfile
import textwrap
import traceback
from collections.abc import Callable, Iterable, Sequence
from typing import NoReturn

from studies import registry
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError, exit_code_table
from studies.common.stops import stops_heard
from studies.common.study import Command, Study, placed

PROGRAM = "antenna-ocp"
Run = Callable[[argparse.Namespace, Console], ExitCode]


ARGPARSE_WORDS = {  # what the parser says, and what we say
    r"^argument (\S+): expected one argument$": r"\1 has no value",
    r"^argument (\S+): ignored explicit argument (.*)$": r"\1 takes no value, but \2 is given",
    r"^argument (\S+): invalid choice: (.*) \((choose from .*)\)$": r"\1 is \2; \3",
    r"^argument (--\S+): ": r"\1: ",
}


def main(
    arguments: Sequence[str] | None = None, listen: Callable[[], object] = lambda: None
) -> int:
    """Run the command; return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        The words after its name; those of the process by default.
    listen : callable
        Called when all that takes long to load is loaded, so that Ctrl-C may be listened to.
    """
    console = Console()
    try:
        with console.at_work():
            options, run = parse(sys.argv[1:] if arguments is None else arguments)
            listen()
            with stops_heard(console):
                return int(run(options, console))
    except StudyError as error:
        console.complain(str(error))
        return int(error.exit_code)
    except KeyboardInterrupt:
        console.complain("interrupted; the files written so far are kept")
        return int(ExitCode.INTERRUPTED)
    except BrokenPipeError:  # as in `antenna-ocp paper | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return int(ExitCode.OK)
    except Exception as error:
        return _report_defect(error, console)


def parse(words: Sequence[str]) -> tuple[argparse.Namespace, Run]:
    """What a command line asks, and the function that does it.

    Raises
    ------
    StudyError
        If a sub-command or flag is unknown, or an argument is missing.
    """
    words = list(words)
    if not words:
        raise StudyError(f"a sub-command is missing; {PROGRAM} --help lists them")
    if words[0] in ("-h", "--help"):
        return argparse.Namespace(), _say(overview())
    if words[0] == "--version":
        return argparse.Namespace(), _say_version

    name = _command_name(words)
    if not _is_command(name):  # a group of sub-commands, with a wish for help or with nothing
        return argparse.Namespace(), _say(overview(name))
    rest = words[len(name.split()) :]
    _refuse_dashes(rest)

    parser = build_parser(name)
    options, unknown = parser.parse_known_args(rest)
    if unknown:
        raise StudyError(_unknown_argument(unknown[0], parser))
    _refuse_repeated_flags(rest, parser)
    from studies.common.key_flags import typed_flags, with_flags_named

    options.typed = typed_flags(parser, options)
    return options, with_flags_named(_run_of(name), options.typed)


def _is_command(name: str) -> bool:
    """Whether a sub-command has that name; those of other packages are looked for last."""
    return name in registry.COMMANDS or name in registry.from_outside()


def _own_module(command: Study | Command) -> str:
    """The module of a command that is one of its own; empty for that of any study."""
    return command.command if isinstance(command, Study) else command.module


def _run_of(name: str) -> Run:
    """What carries a sub-command out; all that it needs is loaded."""
    command = registry.command(name)
    if isinstance(command, Study):
        placed(command.run)
    elif command.loads:
        importlib.import_module(command.loads)
    if own := _own_module(command):
        run: Run = importlib.import_module(own).run
        return run
    assert isinstance(command, Study)
    from studies.common import study_command

    return lambda options, console: study_command.run(command, options, console)


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one sentence, as all errors of the command are."""

    def error(self, message: str) -> NoReturn:
        for theirs, ours in ARGPARSE_WORDS.items():
            message = re.sub(theirs, ours, message)
        raise StudyError(f"{message}; {self.prog} --help explains")


def build_parser(name: str) -> argparse.ArgumentParser:
    """The parser of one sub-command."""
    command = registry.command(name)
    parser = _Parser(
        prog=f"{PROGRAM} {name}",
        description=textwrap.fill(command.description, 80),
        epilog=f"exit codes:\n{exit_code_table()}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        # a shortened flag would one day be another one's
        allow_abbrev=False,
    )
    add_arguments_of(name, parser)
    return parser


def add_arguments_of(name: str, parser: argparse.ArgumentParser) -> None:
    """Let a parser take the arguments of a sub-command."""
    command = registry.command(name)
    if own := _own_module(command):
        importlib.import_module(own).add_arguments(parser)
        return
    assert isinstance(command, Study)
    from studies.common import study_command

    study_command.add_arguments(command, parser)


def overview(group: str = "") -> str:
    """The text of `--help`, of the whole command or of a group of sub-commands."""
    names = [one for one in registry.names() if not group or one.startswith(f"{group} ")]
    width = max(map(len, names))
    prefix = f"{PROGRAM} {group}".rstrip()
    lines = [
        f"usage: {prefix} COMMAND ...",
        "",
        "Optimal deployment of a large ring-truss space antenna and of its supporting arm.",
        "",
        "sub-commands (each has a --help of its own):",
        *(f"  {name:<{width}}  {registry.summary(name)}" for name in names),
    ]
    if not group:
        lines += ["", "flags:", "  -h, --help  this text", "  --version   the version"]
    return "\n".join([*lines, "", "exit codes:", exit_code_table()])


def _command_name(words: Sequence[str]) -> str:
    """The sub-command that a line names, or the group of which it names no member."""
    first, second = words[0], words[1] if len(words) > 1 else ""
    either = (f"{first} {second}", first)
    ours = [name for name in either if name in registry.COMMANDS]
    for name in ours or filter(_is_command, either):  # others are looked for last: it takes longer
        return name

    members = [name.split()[1] for name in registry.names() if name.startswith(f"{first} ")]
    if members and second in ("-h", "--help"):
        return first
    if members and second.startswith("-"):
        raise StudyError(
            f"{PROGRAM} {first} needs a sub-command before {second}: {', '.join(members)}"
        )
    if members:
        given = (
            f"{PROGRAM} {first} has no '{second}'"
            if second
            else f"{PROGRAM} {first} needs a sub-command"
        )
        raise StudyError(f"{given}; {_suggestion(second, members)}")
    if first.startswith("-"):
        raise StudyError(f"unknown flag {first}; {_suggestion(first, ('--help', '--version'))}")
    known = dict.fromkeys(name.split()[0] for name in registry.names())
    raise StudyError(f"unknown sub-command '{first}'; {_suggestion(first, known)}")


def _refuse_repeated_flags(words: Sequence[str], parser: argparse.ArgumentParser) -> None:
    """StudyError if a flag that holds one value is given twice: only one of them would count."""
    given = [word.split("=")[0] for word in words]
    for action in parser._actions:
        once = isinstance(action, argparse._StoreAction) and action.option_strings
        if once and sum(given.count(flag) for flag in action.option_strings) > 1:
            raise StudyError(f"{action.option_strings[-1]} is given twice; remove one of them")


def _refuse_dashes(words: Iterable[str]) -> None:
    """StudyError if the value of a flag is `--`: the parser would take it for no value at all."""
    for word in words:
        flag, _, value = word.partition("=")
        if flag.startswith("--") and value == "--":
            raise StudyError(f"{flag} is '--', which is not a value; give one")


def _unknown_argument(word: str, parser: argparse.ArgumentParser) -> str:
    """What to say of an argument that a sub-command does not have."""
    if not word.startswith("-"):
        return f"'{word}' is one argument too many; {parser.prog} --help explains"
    flag = word.split("=")[0]
    flags = [flag for action in parser._actions for flag in action.option_strings]
    return f"unknown flag {flag}; {_suggestion(flag, flags, f'{parser.prog} --help lists them')}"


def _suggestion(word: str, known: Iterable[str], otherwise: str = "") -> str:
    from studies.common.configuration import nearest  # for errors only

    # the dashes would count as a likeness
    by_name = {name.lstrip("-"): name for name in known}
    near = nearest(word.lstrip("-"), by_name)
    if near:
        return f"did you mean {by_name[near]}?"
    return otherwise or f"choose one of {', '.join(known)}"


def _say(text: str) -> Run:
    def run(options: argparse.Namespace, console: Console) -> ExitCode:
        console.say(text)
        return ExitCode.OK

    return run


def _say_version(options: argparse.Namespace, console: Console) -> ExitCode:
    from studies.common.folder import version

    console.say(f"{PROGRAM} {version(PROGRAM)}")
    return ExitCode.OK


def _report_defect(error: Exception, console: Console) -> int:
    """Write the traceback of an unforeseen `error` to a file and say where it is."""
    with tempfile.NamedTemporaryFile(
        "w", prefix="antenna-ocp-", suffix=".txt", delete=False
    ) as report:
        report.write(" ".join(sys.argv) + "\n\n" + "".join(traceback.format_exception(error)))
    console.complain(
        f"unforeseen {type(error).__name__}: {error}; this is a defect of the program: please send "
        f"the report {report.name} to its authors"
    )
    return int(ExitCode.INTERNAL)
