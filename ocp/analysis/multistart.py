"""Many starts, in parallel: which optima a problem has, as far as they find out.

Every start is solved and verified on its own, in processes forked from this one where the
platform forks (problems hold CasADi symbols and cannot be sent; what comes back refers to the
symbols of the caller by their place in the statement), one after the other elsewhere.
"""

from __future__ import annotations

import io
import multiprocessing
import os
import pickle
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ocp.errors import Interrupted, SolveFailed, StatementError
from ocp.mesh.random_guess import random_trajectory
from ocp.mesh.trajectory import Trajectory
from ocp.problem.statement import Problem
from ocp.problem.symbols import time
from ocp.settings import Settings
from ocp.solution.solution import Solution
from ocp.solution.storage import _Pickler
from ocp.solve import solve

_SAME_PATH = 1e-2  # of the states' sizes, within which two motions count as one
_SAMPLES = np.linspace(0.0, 1.0, 201)


@dataclass(frozen=True, eq=False)
class Optimum:
    """One of the distinct optima.

    Attributes
    ----------
    starts : names of the starts that ended here.
    distance : of its states from the best motion's, largest over time, relative to their sizes.
    """

    solution: Solution
    starts: tuple[str, ...]
    distance: float

    @property
    def objective(self) -> float:
        """Value of the objective, in the user's sense."""
        return self.solution.objective


@dataclass(frozen=True, eq=False)
class Audit:
    """What came of all starts: distinct optima, the best one first, and failures with reasons."""

    problem: str
    optima: tuple[Optimum, ...]
    failures: tuple[tuple[str, str], ...]
    verdict: str

    @property
    def best(self) -> Solution:
        """The best solution found, with the verdict of the audit."""
        return replace(self.optima[0].solution, verdict=self.verdict)

    def __str__(self) -> str:
        lines = [f"{self.problem}: {self.verdict}"]
        lines += [
            f"  {o.objective:.10g} from {len(o.starts)} ({', '.join(o.starts)}), "
            f"{o.distance:.2g} away"
            for o in self.optima
        ]
        return "\n".join([*lines, *(f"  failed: {name}: {why}" for name, why in self.failures)])


def audit(
    problem: Problem, *, starts: int = 8, guesses: Sequence[Solution | Trajectory] = (),
    seed: int = 0, processes: int | None = None, settings: Settings | None = None,
    bound: float | None = None, progress: Callable[[str], None] | None = None,
) -> Audit:  # fmt: skip
    """Solve from several starts and compare what they find.

    Parameters
    ----------
    starts : int
        Number of starts: the stated guess, then `guesses`, and random ones around the stated
        guess and inside all bounds for the rest.
    seed : int
        Of the random starts.
    processes : int, optional
        At once; by default as many as there are processors for this process.
    bound : float, optional
        As of `ocp.solve`.
    progress : callable, optional
        Receives one line of text for each start that is done.

    Raises
    ------
    StatementError
        When the statement contradicts itself or there is no start.
    SolveFailed
        When every start failed; the message is that of the stated guess.
    Interrupted
        When the user stopped it; ``error.verified`` is the best solution until then.
    """
    if starts < 1:
        raise StatementError(f"an audit of {starts} starts finds nothing; give at least 1")
    settings = settings or Settings()
    named: list[tuple[str, Solution | Trajectory | None]] = [("stated guess", None)]
    named += [(f"guess {i}", guess) for i, guess in enumerate(guesses, start=1)]
    named += [
        (f"random {i}", random_trajectory(problem, settings, np.random.default_rng([seed, i])))
        for i in range(1, starts - len(named) + 1)
    ]
    job = _Job(problem, settings, bound, [guess for _, guess in named])
    found: list[tuple[str, Solution]] = []
    failures: list[tuple[str, SolveFailed]] = []
    try:
        for (name, _), result in zip(named, _results(job, processes), strict=True):
            if isinstance(result, Solution):
                found.append((name, result))
            else:
                failures.append((name, result))
            if progress:
                progress(f"{problem.name}: {name} done, {len(found)} of {len(named)} solved")
    except (KeyboardInterrupt, Interrupted) as stop:
        best = min(found, key=lambda f: problem.sense * f[1].objective, default=(None, None))[1]
        raise Interrupted(
            f"the audit of '{problem.name}' was stopped after {len(found)} solved starts",
            verified=best) from stop  # fmt: skip
    if not found:
        raise failures[0][1]
    return _compared(problem, settings, found, failures)


@dataclass(frozen=True, eq=False)
class _Job:
    """What every process needs; forked processes inherit it."""

    problem: Problem
    settings: Settings
    bound: float | None
    guesses: list[Solution | Trajectory | None]

    def run(self, number: int) -> Solution | SolveFailed:
        """Solve from one start; a failure is returned without its iterate."""
        try:
            return solve(self.problem, settings=self.settings, guess=self.guesses[number],
                         bound=self.bound)  # fmt: skip
        except SolveFailed as error:
            return type(error)(str(error))

    def shared(self) -> list[Any]:
        """Objects that both sides of a fork know, in one order."""
        problem = self.problem
        return [problem, *problem.phases, *problem.symbols, time, *problem.bounds, *problem.links]


_JOB: list[_Job] = []  # set before the fork, read behind it


def _results(job: _Job, processes: int | None) -> Iterator[Solution | SolveFailed]:
    count = len(job.guesses)
    workers = min(processes or _processors(), count)
    if workers == 1 or "fork" not in multiprocessing.get_all_start_methods():
        yield from map(job.run, range(count))
        return
    _JOB[:] = [job]
    others = set(multiprocessing.active_children())
    try:
        with warnings.catch_warnings():
            # Python 3.12 and later warn of threads around a fork; those of linear algebra are idle
            warnings.simplefilter("ignore", DeprecationWarning)
            with ProcessPoolExecutor(workers, multiprocessing.get_context("fork")) as pool:
                try:
                    yield from (_received(job, data) for data in pool.map(_sent, range(count)))
                except BaseException:
                    for child in set(multiprocessing.active_children()) - others:
                        child.terminate()  # or they would finish starts nobody waits for
                    raise
    finally:
        _JOB.clear()


def _processors() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class _Sender(_Pickler):
    """Writes what both sides of a fork share as a number."""

    def __init__(self, file: io.BytesIO, shared: list[Any]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self._places = {id(thing): i for i, thing in enumerate(shared)}

    def persistent_id(self, value: Any) -> int | None:
        return self._places.get(id(value))


class _Receiver(pickle.Unpickler):
    def __init__(self, file: io.BytesIO, shared: list[Any]) -> None:
        super().__init__(file)
        self._shared = shared

    def persistent_load(self, place: int) -> Any:
        return self._shared[place]


def _sent(number: int) -> bytes:
    """Run in a forked process: the result of one start as bytes."""
    job = _JOB[0]
    result, stream = job.run(number), io.BytesIO()
    parts = (
        {f.name: getattr(result, f.name) for f in fields(result)}
        if isinstance(result, Solution) else (type(result), str(result))
    )  # fmt: skip
    _Sender(stream, job.shared()).dump(parts)
    return stream.getvalue()


def _received(job: _Job, data: bytes) -> Solution | SolveFailed:
    parts = _Receiver(io.BytesIO(data), job.shared()).load()
    return Solution(**parts) if isinstance(parts, dict) else parts[0](parts[1])


def _compared(
    problem: Problem, settings: Settings, found: list[tuple[str, Solution]],
    failures: list[tuple[str, SolveFailed]],
) -> Audit:  # fmt: skip
    """Sort solutions by value, and put those of one motion together."""
    order = [name for name, _ in found]
    found = sorted(found, key=lambda f: problem.sense * f[1].objective)
    best = found[0][1]
    groups: list[tuple[Solution, list[str]]] = []
    for name, solution in found:
        for other, names in groups:
            if _close(solution, other, settings) and distance(solution, other) <= _SAME_PATH:
                names.append(name)
                break
        else:
            groups.append((solution, [name]))
    optima = tuple(
        Optimum(s, tuple(sorted(names, key=order.index)), distance(s, best)) for s, names in groups
    )
    agreed = sum(_close(s, best, settings) for _, s in found)
    count = len(found) + len(failures)
    verdict = best.verdict
    if not verdict.startswith("global"):
        parts = [f"{agreed} agree"]
        parts += [f"{len(found) - agreed} ended elsewhere"] if agreed < len(found) else []
        parts += [f"{len(failures)} failed"] if failures else []
        verdict = f"local: best of {count} starts ({', '.join(parts)})"
    reasons = tuple((name, f"{type(e).__name__}: {e}") for name, e in failures)
    return Audit(problem.name, optima, reasons, verdict)


def _close(one: Solution, other: Solution, settings: Settings) -> bool:
    """Whether two objectives are the same to ten times the tolerance of either."""
    size = max(abs(one.objective), abs(other.objective), 1e-3 * one.kept_program.scales.objective)
    return abs(one.objective - other.objective) <= 10 * settings.objective_tolerance * size


def distance(one: Solution, other: Solution) -> float:
    """Largest distance of two motions at equal fractions of their phases, relative to sizes."""
    most, scales = 0.0, one.kept_program.scales
    for a, b in zip(one.trajectory.phases, other.trajectory.phases, strict=True):
        first, second = a.at_fractions(_SAMPLES), b.at_fractions(_SAMPLES)
        for name in a.states:
            gap = float(np.abs(first[name] - second[name]).max()) / scales.signals[name]
            most = max(most, gap)
        most = max(most, abs((a.end - a.start) - (b.end - b.start)) / scales.time)
    return most
