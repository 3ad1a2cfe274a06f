"""What can be swept: studies that say how, and keys of them that vary.

A case of a sweep is what the command of its subject would solve, given the case's TOML.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies import registry
from studies.common.configuration import closest, table
from studies.common.console import silent
from studies.common.exit_codes import StudyError, quoted
from studies.common.keys import key_lines
from studies.common.study import Study, Swept, placed

if TYPE_CHECKING:
    from studies.common.result import Result


def subject(name: str) -> tuple[Study, Swept]:
    """The study of a command, and how it is swept.

    Raises
    ------
    StudyError
        If there is no such study, or it cannot be swept.
    """
    known = registry.names()
    study = registry.command(name) if name in known else None
    if isinstance(study, Study) and study.sweep is not None:
        return study, study.sweep
    swept = [one.name for one in registry.studies() if one.sweep is not None]
    raise StudyError(f"subject is {quoted(name)}; {closest(name, swept)}")


def with_files(study: Study, raw: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """A study with the contents of the files that it names.

    Raises
    ------
    StudyError
        If one cannot be read.
    """
    raw = table("base", raw)
    joints = raw.get("joint", ())
    if study.beside is None or not any(isinstance(one, Mapping) and "csv" in one for one in joints):
        return dict(raw)
    return study.configuration(placed(study.beside)(_stated(study, raw), folder))


def resolved(study: Study, raw: Mapping[str, Any]) -> dict[str, Any]:
    """All keys of a study, those that take their defaults among them.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    return study.configuration(_stated(study, raw))


def solved(
    study: Study, configuration: Mapping[str, Any], neighbour: Result | None = None
) -> Result:
    """The result of a study.

    Parameters
    ----------
    configuration : mapping
        As `resolved` gives it.
    neighbour : Result, optional
        Of a like study, whose motion is one more to start from.

    Raises
    ------
    StudyError
        If it cannot be met or is not solved.
    """
    how = {} if neighbour is None else {"neighbour": neighbour}
    found: Result = placed(study.run)(_stated(study, configuration), silent(), **how)
    return found


def units(study: Study, keys: Iterable[str]) -> dict[str, str]:
    """Units of some of its keys, where they have one; the entries of a list share theirs."""
    known = {
        line.key: line.unit
        for name, kind in study.tables().items()
        for line in key_lines(kind, f"{name}." if name else "", deep=True)
    }
    found = {}
    for key in keys:
        unit = known.get(".".join(part for part in key.split(".") if not part.isdigit()), "")
        if unit not in ("", "-"):
            found[key] = unit
    return found


def _stated(study: Study, raw: Mapping[str, Any]) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what the model warns of stops nothing
        return study.stated(raw)


def put_value(raw: Any, place: tuple[str, ...], value: Any, name: str) -> Any:
    """A copy of nested tables and lists with one value changed.

    Parameters
    ----------
    place : tuple of str
        Keys from the outside in; a number is a place in a list, from 0.
    name : str
        Of the whole, for the sentence.

    Raises
    ------
    StudyError
        If the study has something else than a table or list where one has to be.
    """
    if not place:
        return value
    first, rest = place[0], place[1:]
    if isinstance(raw, list | tuple):
        if not (first.isdigit() and int(first) < len(raw)):
            raise StudyError(
                f"{name}: there is no entry {quoted(first)} in a list of {len(raw)}; number its "
                "entries from 0"
            )
        number = int(first)
        return [*raw[:number], put_value(raw[number], rest, value, name), *raw[number + 1 :]]
    if not isinstance(raw, Mapping):
        raise StudyError(
            f"{name}: there is a value {quoted(raw)} where {quoted(first)} needs a table"
        )
    return {**raw, first: put_value(raw.get(first, {}) if rest else None, rest, value, name)}
