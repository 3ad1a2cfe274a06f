"""The cases of a sweep: what each asks, and the name of its file.

A case is named by a hash of what it asks and of what would answer it. So a file is found again
only where the same question would be put to the same code.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from studies.common.code_version import CodeVersion, code_version, hashed
from studies.common.console import Console
from studies.common.exit_codes import StudyError
from studies.sweep.cases.samples import Point, design
from studies.sweep.config import SweepStudy
from studies.sweep.subjects import put_value, resolved, subject

# packages that answer cases
STUDIES = ("arm", "common", "drive", "flex", "fronts", "margin", "pareto", "truss")


@dataclass(frozen=True)
class Case:
    """One case of a sweep.

    Attributes
    ----------
    number : its place in the sweep, from 0.
    point : values of the keys that vary.
    key : name of its file.
    parent : key of the case whose motion it also starts from, or None.
    refusal : why the study of these values is none; empty if it is one.
    """

    number: int
    point: Point
    key: str
    parent: str | None
    refusal: str = ""


@dataclass(frozen=True, eq=False)
class Plan:
    """All cases of a sweep.

    Attributes
    ----------
    study : the sweep.
    cases : in the order of the table.
    version : of the code that answers them.
    """

    study: SweepStudy
    cases: tuple[Case, ...]
    version: CodeVersion

    def configuration(self, case: Case) -> dict[str, Any]:
        """The resolved study of a case; worked out when it is needed, as there may be many."""
        return _resolved(self.study, case.point)


def plan(study: SweepStudy, console: Console | None = None) -> Plan:
    """Plan a sweep: nothing is solved.

    Parameters
    ----------
    study : SweepStudy
        What is asked.
    console : Console, optional
        Where the progress of a long plan goes.

    Raises
    ------
    StudyError
        If no case of it is a study: then the sweep asks something wrong.
    """
    points, answered_by = design(study), code_version(STUDIES)
    keys: list[str] = []
    cases: list[Case] = []
    for number, (point, parent) in enumerate(zip(points.points, points.parents, strict=True)):
        start = None if parent is None else keys[parent]
        try:
            asked: Mapping[str, Any] = _resolved(study, point)
            refusal = ""
        except StudyError as error:
            asked, refusal = {"refused": list(point)}, str(error)
        identity = [study.subject, asked, study.mode, start, answered_by.name]
        keys.append(hashed(identity)[:24])
        if console is not None:
            console.live(f"{number + 1} of {len(points.points)} cases are planned")
        cases.append(Case(number, point, keys[-1], start, refusal))

    if all(case.refusal for case in cases):
        raise StudyError(cases[0].refusal)
    return Plan(study, tuple(cases), answered_by)


def _resolved(study: SweepStudy, point: Point) -> dict[str, Any]:
    """The study at a point, with all its keys.

    Raises
    ------
    StudyError
        If it is none.
    """
    swept, how = subject(study.subject)
    raw = dict(study.base)
    if study.coarse:
        for name, value in how.coarse.items():
            raw = put_value(raw, tuple(name.split(".")), value, name)
    for axis, value in zip(study.parameters, point, strict=True):
        if value is not None:
            raw = put_value(raw, axis.place(), value, f"parameters.{axis.key}")
    return resolved(swept, raw)
