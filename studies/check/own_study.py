"""A profile that is held against a study of another package, which says what it has to keep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ocp.arrays import Array
from studies import registry
from studies.check.reading.headers import own_column
from studies.check.reading.raw_table import read_table
from studies.check.reading.table import refuse
from studies.common.configuration import check_keys, closest
from studies.common.console import Console
from studies.common.exit_codes import StudyError, quoted
from studies.common.result import Result
from studies.common.study import Study, placed


def judging_study(name: str) -> Study:
    """The study of a command that judges profiles.

    Raises
    ------
    StudyError
        If there is none.
    """
    found = registry.command(name) if name in registry.names() else None
    if isinstance(found, Study) and found.judge is not None:
        return found
    known = [study.name for study in registry.studies() if study.judge is not None]
    hint = "remove it: a profile of the truss or the arm is recognised by its columns"
    if known:
        hint = closest(name, known)
    raise StudyError(
        f"--study is {quoted(name)}, which is not a study that checks profiles; {hint}"
    )


def check_own(
    study: Study, stated: Any, path: Path, asked: Sequence[str], console: Console
) -> Result:
    """What a study says of the profile in a file.

    Parameters
    ----------
    stated : configuration
        The study that the profile is held against.
    asked : sequence of str
        WHAT=HEADER:UNIT, of columns that are not found by their names.

    Raises
    ------
    StudyError
        If a column is missing, or holds no rising times or no numbers.
    """
    named = dict(one.partition("=")[::2] for one in asked)
    check_keys(named, study.profile, "--column ")
    columns = _columns(path, study.profile, named)
    assert study.judge is not None
    result: Result = placed(study.judge)(stated, columns, console)
    return result


def _columns(path: Path, units: Mapping[str, str], named: Mapping[str, str]) -> dict[str, Array]:
    """The columns that a study needs, in its units."""
    table = read_table(path)
    places = [own_column(table, name, unit, named.get(name, "")) for name, unit in units.items()]
    arrays = table.column([place for place, _ in places])
    found = {
        name: factor * array for name, (_, factor), array in zip(units, places, arrays, strict=True)
    }
    for name, array in found.items():
        bad = np.flatnonzero(~np.isfinite(array))
        if bad.size:
            refuse(path, f"has no number for {name} in {table.line_of(int(bad[0]))}; fill it in")
    if "time" in found:
        back = np.flatnonzero(np.diff(found["time"]) <= 0.0)
        if back.size:
            refuse(
                path,
                f"has a time that does not increase in {table.line_of(int(back[0]) + 1)}; sort "
                "its rows",
            )
    return found
