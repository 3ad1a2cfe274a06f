"""All sub-commands by name, and the studies of other packages.

A study is one line here, or the entry point of another package in the group `antenna_ocp.studies`.
Nothing is loaded before it is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING

from studies.common.exit_codes import StudyError
from studies.common.study import Command, Mechanism, Study, placed

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "antenna_ocp.studies"

# In the order of `--help`. A name of two words is a sub-command of a sub-command.
COMMANDS: dict[str, str] = {
    "truss": "studies.truss.command:STUDY",
    "arm solve": "studies.arm.command:SOLVE",
    "arm baselines": "studies.arm.command:BASELINES",
    "arm least-duration": "studies.arm.command:LEAST_DURATION",
    "arm sequence": "studies.arm.command:SEQUENCE",
    "codesign": "studies.codesign.command:STUDY",
    "mission": "studies.mission.command:STUDY",
    "turn": "studies.turn.command:STUDY",
    "pareto truss": "studies.pareto.command:STUDY",
    "pareto arm": "studies.arm.command:TRADE_OFF",
    "robust truss": "studies.robust.command:STUDY",
    "robust arm": "studies.arm.command:ROBUST",
    "sweep": "studies.sweep:STUDY",
    "flex": "studies.flex.command:STUDY",
    "check": "studies.check:STUDY",
    "report": "studies.report:COMMAND",
    "export": "studies.export:COMMAND",
    "keys": "studies.keys:COMMAND",
    "completion": "studies.completion:COMMAND",
    "paper": "studies.paper.command:STUDY",
}


@cache
def from_outside() -> dict[str, EntryPoint]:
    """The studies of other packages by name; those of this one cannot be replaced."""
    from importlib.metadata import entry_points  # takes as long as all of the rest here

    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    return {name: entry for name, entry in found.items() if name not in COMMANDS}


def names() -> tuple[str, ...]:
    """All sub-commands, in the order of `--help`."""
    return (*COMMANDS, *from_outside())


@cache
def command(name: str) -> Study | Command:
    """A sub-command.

    Raises
    ------
    StudyError
        If that of another package cannot be loaded.
    """
    if name in COMMANDS:
        found = placed(COMMANDS[name])
        assert isinstance(found, Study | Command)
        return found
    entry = from_outside()[name]
    try:
        found = entry.load()
    except Exception as error:  # of somebody else's module
        raise StudyError(
            f"the study '{name}' of {_package(entry)} cannot be loaded ({error}); install that "
            "package again, or remove it"
        ) from error
    if not isinstance(found, Study):
        raise StudyError(
            f"the entry point '{name}' of {_package(entry)} is {entry.value}, which is no Study; "
            "name one there"
        )
    return found


def summary(name: str) -> str:
    """The line of a sub-command in `--help`; one of another package is not loaded for it."""
    if name in COMMANDS:
        return command(name).summary
    return f"a study of {_package(from_outside()[name])}"


def _package(entry: EntryPoint) -> str:
    return f"the package {entry.dist.name}" if entry.dist is not None else entry.value


def studies() -> Iterator[Study]:
    """All studies, loaded."""
    for name in names():
        if isinstance(found := command(name), Study):
            yield found


def study_named(name: str) -> Study:
    """The study of a command; KeyError if there is none."""
    found = command(name) if name in names() else None
    if not isinstance(found, Study):
        raise KeyError(name)
    return found


def study_of(kind: str) -> Study | None:
    """The study whose results are of a kind; None if there is none.

    Those of this package are looked at first, so that a package that is broken stops none of them.
    """
    for name in names():
        found = command(name)
        if isinstance(found, Study) and (kind == found.kind or kind in found.also):
            return found
    return None


def mechanism_of(kind: str) -> Mechanism | None:
    """The mechanism of results of a kind; None if their study states none, or there is none."""
    study = study_of(kind)
    if study is None:
        return None
    place = study.also.get(kind, study.mechanism)
    return placed(place) if isinstance(place, str) else place
