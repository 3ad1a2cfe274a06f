"""Steps of a study that are done, in its results folder: one that was stopped goes on from them.

A step is what takes seconds: a search from one start, a solve, a replay. What comes of it is one
file, which is there as a whole or not at all. All steps depend on the keys of the study and on the
code. So the files are in a folder that is named by a hash of both, and no other study or version
finds them. There a step is known by its name: a study takes the same steps whenever it is run.

Nothing in a file can run code, see `ocp.solution.storage`.
"""

from __future__ import annotations

import dataclasses
import functools
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ocp import Interrupted, OcpError, Problem, Solution, Trial
from ocp.solution.storage import packed, unpacked
from studies.common.code_version import code_version, hashed
from studies.common.console import Console
from studies.common.exit_codes import StudyError
from studies.common.processes.side_by_side import Part
from studies.common.study import placed
from studies.common.whole_files import write_whole

FOLDER, ENDING = "steps", ".step"
EARLIER = "found in an earlier run"  # what is said of a step that is not taken again
OURS = ("models", "ocp", "studies")  # packages whose classes a file may hold

_T = TypeVar("_T")


@dataclass(frozen=True)
class FinishedSteps:
    """The finished steps of a study, or of a part of it.

    Attributes
    ----------
    place : folder of their files; None where nothing is kept, so that every step is taken.
    """

    place: Path | None = None

    def within(self, name: str) -> FinishedSteps:
        """Those of a part of the study, such as one of several searches."""
        return self if self.place is None else FinishedSteps(self.place / name)

    @property
    def count(self) -> int:
        """How many there are, with those of all parts."""
        return 0 if self.place is None else sum(1 for _ in self.place.rglob(f"*{ENDING}"))

    def step(
        self,
        name: str,
        take: Callable[[], _T],
        known: Problem | None = None,
        say: Callable[[str], None] = lambda line: None,
        done: Callable[[_T], bool] = lambda new: not getattr(new, "interrupted", False),
        begins_with: str = "",
    ) -> _T:
        """What comes of a step, which is taken unless it is finished.

        Parameters
        ----------
        name : str
            Of the step, for the user, and of no other one here that begins with the same.
        take : callable
            Takes it.
        known : Problem, optional
            Of the solutions that come of it, as it is stated here.
        say : callable, optional
            Receives a line where the step is finished.
        done : callable, optional
            Whether what came of it is to be kept: by default unless the user has stopped it, as its
            `interrupted` says.
        begins_with : str, optional
            Few letters of what it begins with, as `mark` gives them: for a step that may begin
            elsewhere in another run, as where seconds ran out.
        """
        file = f"{name} {begins_with}".rstrip()
        if (earlier := self._read(file, known)) is not None:
            say(f"{name}: {EARLIER}")
            found: _T = earlier[0]
            return found
        new = take()
        if done(new):
            self._keep(file, (new,), known)
        return new

    def part(self, name: str, function: Callable[..., Any], *arguments: Any) -> Part:
        """A step for `side_by_side`: the process that takes it keeps it, at once.

        Parameters
        ----------
        function, arguments : as of `Part`.
        """
        if self.place is None:
            return Part(function, arguments)
        return Part(_taken, (self, name, function, arguments))

    def names(self, kind: str) -> tuple[str, ...]:
        """Names of the starts of a kind that are here."""
        files = [] if self.place is None else sorted(self.place.glob(f"{kind}-*{ENDING}"))
        return tuple(file.name[len(kind) + 1 : -len(ENDING)] for file in files)

    def keep(self, kind: str, trial: Trial) -> bool:
        """Write what came of a start, and say whether it is new, and not here from an earlier run.

        A start that the user stopped is not finished, and is not written.
        """
        name = f"{kind}-{trial.name}"
        if self.place is not None and self._file(name).exists():
            return False
        stopped = trial.solution is not None and trial.solution.interrupted
        if not (stopped or isinstance(trial.error, Interrupted)):
            failure = None if trial.error is None else str(trial.error)
            problem = None if trial.solution is None else trial.solution.problem
            self._keep(name, (trial.solution, failure, trial.value, trial.seconds), problem)
        return True

    def read(self, kind: str, name: str, problem: Problem | None) -> Trial | None:
        """What came of a start; None if it is not here, so that it is solved again.

        A damaged file is removed.

        Parameters
        ----------
        problem : Problem or None
            As it is stated for this start; None where it cannot be stated.
        """
        file = f"{kind}-{name}"
        try:
            solution, failure, value, seconds = self._read(file, problem) or ()
            error = None if failure is None else OcpError(failure)
            return Trial(name, solution, error, float(value), float(seconds))
        except (TypeError, ValueError):
            if self.place is not None:
                self._file(file).unlink(missing_ok=True)
            return None

    def known(
        self, kind: str, starts: Mapping[str, Callable[[], Problem]]
    ) -> dict[str, Callable[[], Trial | None]]:
        """Those of some starts that are here, for `ocp.audit`; each is read when its turn comes."""

        def again(name: str) -> Trial | None:
            try:
                problem = starts[name]()
            except StudyError:  # as the phase plane may fail as a start
                problem = None
            return self.read(kind, name, problem)

        here = [name for name in self.names(kind) if name in starts]
        return {name: functools.partial(again, name) for name in here}

    def _keep(self, name: str, content: tuple[Any, ...], known: Problem | None) -> None:
        if self.place is not None:
            self.place.mkdir(parents=True, exist_ok=True)
            write_whole(self._file(name), packed(content, known, _class_at))

    def _read(self, name: str, known: Problem | None) -> tuple[Any, ...] | None:
        """The content of a file; None if there is none, or none that can be trusted."""
        if self.place is None:
            return None
        try:
            content = unpacked(self._file(name).read_bytes(), known, name, _class_at)
        except (OSError, OcpError):
            return None
        return content if isinstance(content, tuple) else None

    def _file(self, name: str) -> Path:
        assert self.place is not None
        return self.place / f"{name.replace('/', '_')}{ENDING}"


def _taken(
    steps: FinishedSteps,
    name: str,
    function: Callable[..., Any],
    arguments: tuple[Any, ...],
    console: Console,
) -> Any:
    return steps.step(name, lambda: function(*arguments, console), say=console.progress)


NOTHING_KEPT = FinishedSteps()
"""In place of a folder: every step is taken, and none is written."""


def finished_steps(folder: Path, question: Any) -> FinishedSteps:
    """The steps in a results folder that this code has taken for a question.

    Parameters
    ----------
    question : what JSON can hold
        All that is asked.
    """
    return FinishedSteps(folder / FOLDER / hashed([question, code_version().name])[:12])


def forget_steps(folder: Path) -> None:
    """Remove all finished steps from a results folder: those of other keys and versions, too."""
    shutil.rmtree(folder / FOLDER, ignore_errors=True)


def mark(solution: Solution) -> str:
    """Few letters that differ where motions do: for steps that begin with what was found."""
    phases = solution.trajectory.phases
    numbers = [np.atleast_1d(solution.objective), *(phase.breakpoints for phase in phases)]
    return hashed(np.concatenate(numbers).tolist())[:12]


def _class_at(place: str) -> type[Any]:
    """A frozen dataclass of this program; its constructor checks what it is given.

    Raises
    ------
    ValueError
        If there is none.
    """
    module, _, name = place.partition(":")
    if module.partition(".")[0] not in OURS or "." in name:
        raise ValueError(f"'{place}' is no class of this program")
    found = placed(place)
    plain = isinstance(found, type) and dataclasses.is_dataclass(found)
    # a field that no file keeps would come back as something else
    if not (plain and found.__dataclass_params__.frozen) or any(
        field.name.startswith("_") for field in dataclasses.fields(found) if field.init
    ):
        raise ValueError(f"'{place}' is no class whose objects a file may hold")
    return found
