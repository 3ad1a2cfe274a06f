"""Records of solved cases, and the file that keeps them."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from studies.common.exit_codes import StudyError

ROOT = Path(__file__).resolve().parents[1]
MEASURED = ("ocp", "models", "studies")  # the packages whose state a file of records belongs to
LIBRARIES = ("casadi", "numpy", "scipy")
TOTALS = "all"  # name of the row of sums in a table


class RecordError(StudyError):
    """A file of records that cannot be used: one sentence with the remedy."""


@dataclass(frozen=True)
class Record:
    """What became of one case.

    Attributes
    ----------
    name : of the case.
    value : of the objective, in its SI unit; None where there is no answer.
    tolerance : largest relative difference of the value that is no change.
    rounds, iterations : mesh iterations and solver iterations of all solves, failed ones included.
    seconds : processor time from the statement to the answer [s].
    checks : number of checks of the certificate.
    failed_checks : names of those that failed.
    verdict : the answer's verdict, in the program's words.
    failure : why there is no answer; empty where there is one.
    """

    name: str
    value: float | None
    tolerance: float
    rounds: int
    iterations: int
    seconds: float
    checks: int = 0
    failed_checks: tuple[str, ...] = ()
    verdict: str = ""
    failure: str = ""

    @property
    def passed_checks(self) -> int:
        """Number of checks that passed."""
        return self.checks - len(self.failed_checks)

    def as_dictionary(self) -> dict[str, Any]:
        """The record as it is written to a file."""
        return dataclasses.asdict(self)


def record_from(raw: Mapping[str, Any]) -> Record:
    """The record that was written as this dictionary."""
    return Record(**{**raw, "failed_checks": tuple(raw["failed_checks"])})


@dataclass(frozen=True)
class RecordFile:
    """All records of one state of the code.

    Attributes
    ----------
    made_by : commit and versions, see `provenance`.
    records : by name of the case, in the order in which they were measured.
    """

    made_by: Mapping[str, str]
    records: Mapping[str, Record]

    def with_record(self, record: Record) -> RecordFile:
        """The same with one more record, or with another one in its place."""
        return RecordFile(self.made_by, {**self.records, record.name: record})

    def write(self, path: Path) -> None:
        """Write all records as JSON; an interruption leaves the former file."""
        content = {
            "made_by": dict(self.made_by),
            "records": [record.as_dictionary() for record in self.records.values()],
        }
        draft = path.with_name(path.name + ".part")
        draft.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", "utf-8")
        draft.replace(path)


def read_records(path: Path) -> RecordFile:
    """Read a file of records.

    Raises
    ------
    RecordError
        If there is no such file or it holds something else.
    """
    try:
        content = json.loads(path.read_text("utf-8"))
        records = [record_from(raw) for raw in content["records"]]
        made_by = {str(key): str(value) for key, value in content["made_by"].items()}
    except OSError as error:
        raise RecordError(f"the file {path} cannot be read ({error.strerror})") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise RecordError(
            f"the file {path} holds no records of this program ({error}); name another one"
        ) from error
    return RecordFile(made_by, {record.name: record for record in records})


def provenance() -> dict[str, str]:
    """Versions, and the last commit that changed what is measured."""
    versions = {name: metadata.version(name) for name in LIBRARIES}
    return {"commit": _commit(), "python": sys.version.split()[0], **versions}


def _commit() -> str:
    """The last commit of the measured packages, marked if they have changed since."""
    commit = _git("log", "-1", "--format=%H", "--", *MEASURED)
    changed = _git("status", "--porcelain", "--", *MEASURED)
    return (commit or "unknown") + (", changed" if changed else "")


def _git(*arguments: str) -> str:
    """Output of a git command; empty where there is no git or no repository."""
    try:
        done = subprocess.run(
            ["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return ""
    return done.stdout.strip()
