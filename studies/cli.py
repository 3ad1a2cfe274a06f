"""The command `antenna-ocp`: finds the sub-command, turns errors into one sentence and a code.

A sub-command is a line in `COMMANDS`. Its module is loaded only when it is called, so that
`antenna-ocp --help` loads none of them.
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
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, NoReturn

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError, exit_code_table
from studies.common.key_flags import Run, typed_flags, with_flags_named
from studies.common.stops import stops_heard

PROGRAM = "antenna-ocp"


@dataclass(frozen=True)
class Command:
    """One sub-command.

    Attributes
    ----------
    summary : its line in `antenna-ocp --help`.
    module : where it is.
    description : further sentences for its own `--help`.
    arguments : name of the function that adds its arguments to a parser.
    run : name of the function that carries it out.
    loads : module that it needs and that takes long to load; loaded before Ctrl-C is listened to.
    """

    summary: str
    module: str
    description: str = ""
    arguments: str = "add_arguments"
    run: str = "run"
    loads: str = ""


# In the order of `--help`. A name of two words is a sub-command of a sub-command.
COMMANDS: Mapping[str, Command] = {
    "truss": Command(
        "optimal deployment of the ring truss",
        "studies.truss.command",
        "Finds the optimal deployment of the ring truss under stated caps, compares it with the "
        "laws of the paper, verifies, draws and exports it.",
        loads="studies.truss.study",
    ),
    "arm solve": Command(
        "a motion of the supporting arm that leaves it still",
        "studies.arm.command",
        "Finds a motion of the flexible arm that rests at both ends, elastic coordinates "
        "included, and replays it on the full ANCF model, as it does the paper's laws.",
        arguments="solve.add_arguments",
        run="solve.run",
        loads="studies.arm.study",
    ),
    "arm baselines": Command(
        "for each law an optimum of no higher peak torque",
        "studies.arm.command",
        "Replays the paper's laws, a linear torque and shaped ones, and finds for each an "
        "optimum of no higher peak torque.",
        arguments="baselines.add_arguments",
        run="baselines.run",
        loads="studies.arm.study",
    ),
    "arm least-duration": Command(
        "least durations that leave the arm still, of the optimum and each law",
        "studies.arm.command",
        "Finds the least durations of the optimum and of each law that leave at most 1e-6 J under "
        "the Bezier law's peak torque.",
        arguments="least_duration.add_arguments",
        run="least_duration.run",
        loads="studies.arm.study",
    ),
    "arm sequence": Command(
        "big arm, locked dwell and small arm as one problem",
        "studies.arm.command",
        "States both stages and the lock between them as one problem whose times are free: least "
        "common peak torque in a total time, or least time under a torque cap.",
        arguments="sequence.add_arguments",
        run="sequence.run",
        loads="studies.arm.study",
    ),
    "codesign": Command(
        "mechanism and motion of the ring truss as one problem",
        "studies.codesign.command",
        "Finds the crank, link and springs of the ring truss together with its motion, for the "
        "least rope force. Diameter, end tension of the net, holding force, stroke, stowed height "
        "and largest force in a bar are kept. Each bound that presses is listed with its price.",
        loads="studies.codesign.study",
    ),
    "mission": Command(
        "big arm, small arm and ring within one time",
        "studies.mission.command",
        "Shares the time of the whole deployment out among big arm, small arm and ring, so that "
        "the largest part of any cap that a stage uses is least; or finds the least total time "
        "under the caps. Says what the ring's reaction does to the arm, for three laws.",
        loads="studies.mission.study",
    ),
    "pareto truss": Command(
        "what less of one objective of the truss costs in another",
        "studies.pareto.command",
        "Finds the front of two objectives of the truss: the least of one under each limit on the "
        "other, from both ends, with prices, knee and gaps, and compares it with proven bounds "
        "and the paper's laws. Of three objectives it is a surface, found slice by slice. Every "
        "point is a verified motion.",
        loads="studies.pareto.study",
    ),
    "pareto arm": Command(
        "what less of one quantity of the arm costs in another",
        "studies.arm.command",
        "Finds the front of two of duration, residual energy, peak torque and deflection of the "
        "arm: the least of one under each limit on the other, from both ends, with prices, knee "
        "and gaps. Of three it is a surface, found slice by slice. Every point was replayed on the "
        "full model, and leaves it still where the residual energy is not traded. With "
        "time,residual-energy it sets what the smoothest motion and the smooth laws leave against "
        "the duration.",
        arguments="trade_off.add_arguments",
        run="trade_off.run",
        loads="studies.arm.study",
    ),
    "robust truss": Command(
        "one law of the ring truss that serves several scenarios",
        "studies.robust.command",
        "Finds the law of the least rope force in the worst of several scenarios: friction, "
        "springs, net, masses, a joint that sticks. Replays it and the nominal optimum on "
        "thousands of trusses that are drawn, and says how often each breaks a limit.",
        loads="studies.robust.study",
    ),
    "robust arm": Command(
        "a motion of the arm that withstands a spread of stiffness or tip mass",
        "studies.arm.command",
        "Finds the motion of least peak torque of one arm, and two that leave arms of other "
        "stiffness (torque drive) or stiffness and tip mass (angle drive) as still as can be: "
        "with a tenth more peak torque, and with no more. Replays all over the spread. Exit code "
        "5 if a tenth more torque brings the worst residual neither to a fifth nor to 2.5e-7 J.",
        arguments="robust.add_arguments",
        run="robust.run",
        loads="studies.arm.study",
    ),
    "sweep": Command(
        "one study for many values of its keys: grids, lists, samples",
        "studies.sweep.command",
        "Solves a study of the truss, the arm or a chain for many values of any of its keys, each "
        "case in a process of its own, and keeps one file a case: killed at any moment, the same "
        "command goes on. Writes a tidy table and draws curves, heat maps or a tornado. Exit code "
        "5 if a case ended without an answer.",
        loads="studies.sweep.cases.plan",
    ),
    "flex": Command(
        "any chain of flexible links, its joints free, locked or driven",
        "studies.flex.command",
        "Moves a chain of ANCF beams that a TOML file states: links with sections and materials, "
        "joints free, locked or driven by angle or torque, gravity, damping, locks and latches, in "
        "either form of the constraints. Optimises nothing. Exit code 5 if the energy drifts, a "
        "constraint opens, both forms differ or a latch catches nothing.",
    ),
    "check": Command(
        "hold a profile of your own, measured or hand-made, against caps and model",
        "studies.check.command",
        "Reads the profile in whatever dialect it is written, estimates its noise and smooths it "
        "if there is any, evaluates it between its rows on the model of the truss or of the arm, "
        "and compares it with the optimum of the same duration and caps and the paper's laws. "
        "Names every check and cap that fails, by how much, and when.",
        loads="studies.truss.study",
    ),
    "report": Command(
        "a results folder as a page, figures and a film",
        "studies.report.command",
        "Prints what a result says, and writes it as one page that opens offline: answer, "
        "verdict, costs, curves, the antenna in motion, tables, exact input. With two folders the "
        "page compares them. Nothing is solved, but by --gallery.",
    ),
    "export": Command(
        "the motion of a results folder as a table or a polynomial that a drive takes",
        "studies.export.command",
        "Writes the motion of a result as columns, as the table of a drive, or as polynomials. A "
        "table is read back and played as the stated drive does it: interpolated, rounded, passed "
        "through its loop and replayed on the truss. Exit code 5 if that breaks a limit.",
    ),
    "paper": Command(
        "every number and figure of the paper compared with ours",
        "studies.paper.command",
        "Recomputes every number, table, formula and figure of the paper's text with our models: "
        "printed value, ours, the difference, and a verdict in each row. Exit code 5 if what a "
        "verdict rests on was not found.",
    ),
}


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
        console.complain("interrupted; what was written until then is kept")
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
        raise StudyError(f"no sub-command is given; {PROGRAM} --help lists them")
    if words[0] in ("-h", "--help"):
        return argparse.Namespace(), _say(overview())
    if words[0] == "--version":
        return argparse.Namespace(), _say_version

    name = _command_name(words)
    if name not in COMMANDS:  # a group of sub-commands, with a wish for help or with nothing
        return argparse.Namespace(), _say(overview(name))
    rest = words[len(name.split()) :]
    _refuse_dashes(rest)

    parser = build_parser(name)
    options, unknown = parser.parse_known_args(rest)
    if unknown:
        raise StudyError(_unknown_argument(unknown[0], parser))
    _refuse_repeated_flags(rest, parser)
    if COMMANDS[name].loads:
        importlib.import_module(COMMANDS[name].loads)
    run = _named(COMMANDS[name].module, COMMANDS[name].run)
    return options, with_flags_named(run, typed_flags(parser, options))


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one sentence, as all errors of the command are."""

    def error(self, message: str) -> NoReturn:
        for theirs, ours in ARGPARSE_WORDS.items():
            message = re.sub(theirs, ours, message)
        raise StudyError(f"{message}; {self.prog} --help explains")


def build_parser(name: str) -> argparse.ArgumentParser:
    """The parser of one sub-command."""
    command = COMMANDS[name]
    parser = _Parser(
        prog=f"{PROGRAM} {name}",
        description=textwrap.fill(command.description, 80),
        epilog=f"exit codes:\n{exit_code_table()}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        # a shortened flag would one day be another one's
        allow_abbrev=False,
    )
    _named(command.module, command.arguments)(parser)
    return parser


def _named(module: str, name: str) -> Any:
    """What a module calls by a name, which may have dots."""
    return attrgetter(name)(importlib.import_module(module))


def overview(group: str = "") -> str:
    """The text of `--help`, of the whole command or of a group of sub-commands."""
    names = [name for name in COMMANDS if not group or name.startswith(f"{group} ")]
    width = max(map(len, names))
    prefix = f"{PROGRAM} {group}".rstrip()
    lines = [
        f"usage: {prefix} COMMAND ...",
        "",
        "Optimal deployment of a large ring-truss space antenna and of its supporting arm.",
        "",
        "sub-commands (each has a --help of its own):",
        *(f"  {name:<{width}}  {COMMANDS[name].summary}" for name in names),
    ]
    if not group:
        lines += ["", "flags:", "  -h, --help  this text", "  --version   the version"]
    return "\n".join([*lines, "", "exit codes:", exit_code_table()])


def _command_name(words: Sequence[str]) -> str:
    """The sub-command that a line names, or the group of which it names no member."""
    first, second = words[0], words[1] if len(words) > 1 else ""
    if f"{first} {second}" in COMMANDS:
        return f"{first} {second}"
    if first in COMMANDS:
        return first

    members = [name.split()[1] for name in COMMANDS if name.startswith(f"{first} ")]
    if members and second in ("-h", "--help"):
        return first
    if members and second.startswith("-"):
        raise StudyError(
            f"{PROGRAM} {first} of what: before {second} comes one of {', '.join(members)}"
        )
    if members:
        given = f"{PROGRAM} {first} has no '{second}'" if second else f"{PROGRAM} {first} of what"
        raise StudyError(f"{given}; {_suggestion(second, members)}")
    if first.startswith("-"):
        raise StudyError(f"unknown flag {first}; {_suggestion(first, ('--help', '--version'))}")
    known = dict.fromkeys(name.split()[0] for name in COMMANDS)
    raise StudyError(f"unknown sub-command '{first}'; {_suggestion(first, known)}")


def _refuse_repeated_flags(words: Sequence[str], parser: argparse.ArgumentParser) -> None:
    """StudyError if a flag that holds one value is given twice: only one of them would count."""
    given = [word.split("=")[0] for word in words]
    for action in parser._actions:
        once = isinstance(action, argparse._StoreAction) and action.option_strings
        if once and sum(given.count(flag) for flag in action.option_strings) > 1:
            raise StudyError(f"{action.option_strings[-1]} is given twice; leave one of them out")


def _refuse_dashes(words: Iterable[str]) -> None:
    """StudyError if the value of a flag is `--`: the parser would take it for no value at all."""
    for word in words:
        flag, _, value = word.partition("=")
        if flag.startswith("--") and value == "--":
            raise StudyError(f"{flag} is '--', which is no value; give one")


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
        f"unforeseen {type(error).__name__}: {error}; this is a defect, "
        f"please send its authors the report {report.name}"
    )
    return int(ExitCode.INTERNAL)


if __name__ == "__main__":
    import antenna_ocp  # looks whether a folder of the user's hides one of the packages

    sys.exit(antenna_ocp.main())
