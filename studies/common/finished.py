"""Starts and other solves that are done, in the results folder: a killed study goes on from them.

Each start is one file, written beside its place and renamed: it is there as a whole or not at all.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from ocp import Interrupted, OcpError, Problem, Trial
from ocp.arrays import Array
from ocp.solution.storage import packed, unpacked
from studies.common.foreign_text import parsed_json
from studies.common.stored_arrays import stored_arrays

FOLDER = "starts"


@dataclass(frozen=True)
class FinishedStarts:
    """The finished starts of a study.

    Attributes
    ----------
    folder : path
        Of the results.
    """

    folder: Path

    def names(self, kind: str) -> tuple[str, ...]:
        """Names of the starts of a kind that are here."""
        files = sorted((self.folder / FOLDER).glob(f"{kind}-*.json"))
        return tuple(file.stem.removeprefix(f"{kind}-") for file in files)

    def keep(self, kind: str, trial: Trial) -> None:
        """Write what came of a start; one that the user stopped is not finished."""
        stopped = trial.solution is not None and trial.solution.interrupted
        if stopped or isinstance(trial.error, Interrupted):
            return
        place = self.folder / FOLDER
        place.mkdir(parents=True, exist_ok=True)
        record = {
            "value": trial.value if trial.value == trial.value else None,
            "seconds": trial.seconds,
            "failure": None if trial.error is None else str(trial.error),
        }
        if trial.solution is not None:
            data = packed(trial.solution, known=trial.solution.problem)
            _write(place / f"{kind}-{trial.name}.ocp", data)
        # the record comes last: where it is, the rest is
        _write(place / f"{kind}-{trial.name}.json", json.dumps(record).encode())

    def keep_arrays(self, name: str, arrays: Mapping[str, Array]) -> None:
        """Write arrays of doubles, such as those of a motion that a search found."""
        place = self.folder / FOLDER
        place.mkdir(parents=True, exist_ok=True)
        stream = io.BytesIO()
        np.savez_compressed(stream, **cast(Any, dict(arrays)))
        _write(place / f"{name}.npz", stream.getvalue())

    def arrays(self, name: str, names: Iterable[str]) -> dict[str, Array]:
        """The arrays of these names that were kept; empty where there are none, or damaged ones."""
        try:
            return stored_arrays(self.folder / FOLDER / f"{name}.npz", names)
        except ValueError:
            return {}

    def within(self, name: str) -> FinishedStarts:
        """Those of a part of the study, such as one of several searches."""
        return FinishedStarts(self.folder / FOLDER / name)

    def read(self, kind: str, name: str, problem: Problem | None) -> Trial | None:
        """What came of a start; None if its files are damaged, so that it is solved again.

        Parameters
        ----------
        problem : Problem or None
            As it is stated for this start; None where it cannot be stated.
        """
        place = self.folder / FOLDER
        solution_file = place / f"{kind}-{name}.ocp"
        try:
            record = parsed_json((place / f"{kind}-{name}.json").read_text("utf-8"))
            solution = None
            if solution_file.is_file() and problem is not None:
                solution = unpacked(solution_file.read_bytes(), known=problem, name=name)
            failure = record["failure"]
            error = None if failure is None else OcpError(failure)
            value = float("nan") if record["value"] is None else float(record["value"])
            if error is None and solution is None:
                return None
            return Trial(name, solution, error, value, float(record["seconds"]))
        except (OSError, ValueError, KeyError, TypeError):
            return None


def _write(path: Path, data: bytes) -> None:
    draft = path.with_suffix(".part")
    draft.write_bytes(data)
    draft.replace(path)
