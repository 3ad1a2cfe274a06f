"""A solution as text: in a few lines, as columns, and as a CSV file."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ocp.arrays import Array
from ocp.problem.display import objective_unit, with_unit
from ocp.problem.symbols import Between, Signal
from ocp.solution.disk import write_file

if TYPE_CHECKING:
    from ocp.solution.solution import Solution

# part of the duration within which a time is at its limit: what the solver's barrier leaves
_AT_LIMIT = 1e-6

_MOST_NUMBERS = 5  # of unknowns or peaks that are listed
_PER_INTERVAL = 8  # rows of an interval by default, beside its right end


def table(solution: Solution, times: Any = None) -> dict[str, Any]:
    """Columns by name: "time" [s], "phase" where there are several, and all signals.

    Parameters
    ----------
    times : array, optional
        [s].  By default each phase is sampled on its own, both ends included, so that an instant
        shared by two phases has two rows.

    Returns
    -------
    dict
        Arrays (m,) of one length; nan where a phase lacks a signal.
    """
    motions = solution.trajectory.phases
    if times is None:
        stretches = [(motion.name, _instants(motion.breakpoints)) for motion in motions]
    else:
        stretches = list(_by_phase(solution, np.atleast_1d(np.asarray(times, dtype=float))))

    columns: dict[str, Any] = {"time": np.concatenate([t for _, t in stretches])}
    if len(motions) > 1:
        lengths = [len(t) for _, t in stretches]
        columns["phase"] = np.repeat([name for name, _ in stretches], lengths)
    for name in dict.fromkeys(name for motion in motions for name in motion.signals):
        columns[name] = np.concatenate([_column(solution, name, *stretch) for stretch in stretches])
    return columns


def _instants(breakpoints: Array) -> Array:
    """Times of one phase, equally spaced in each interval."""
    inner = np.linspace(0.0, 1.0, _PER_INTERVAL, endpoint=False)
    times = breakpoints[:-1, None] + np.diff(breakpoints)[:, None] * inner
    return np.append(times.ravel(), breakpoints[-1])


def _by_phase(solution: Solution, times: Array) -> Iterator[tuple[str, Array]]:
    """Stretches of times that belong to one phase, in the order given."""
    motions = solution.trajectory.phases
    starts = np.array([motion.start for motion in motions])
    owner = np.clip(np.searchsorted(starts, times, side="right") - 1, 0, None)
    cuts = np.flatnonzero(np.diff(owner)) + 1
    for numbers, stretch in zip(np.split(owner, cuts), np.split(times, cuts), strict=True):
        if stretch.size:
            yield motions[numbers[0]].name, stretch


def _column(solution: Solution, name: str, phase: str, times: Array) -> Array:
    """A signal at times of one phase, nan if the phase lacks it."""
    if name not in solution.trajectory.phase(phase).signals:
        return np.full(times.shape, np.nan)
    return solution.sample(name, times, phase)


def write_csv(solution: Solution, path: str | Path, times: Any = None) -> None:
    """Write the table of a solution, with units in its header.

    Lines that begin with ``#`` say what it is: the problem, the objective, the verdict, errors,
    numbers of the problem and the version of the program.

    Raises
    ------
    FileError
        When the folder is missing, or the file cannot be written.
    """
    columns = table(solution, times)
    units = {s.name: s.unit for s in solution.problem.symbols if isinstance(s, Signal)}
    header = [f"{name} [{units[name]}]" if name in units else name for name in columns]
    header[0] = "time [s]"

    text = io.StringIO()
    text.writelines(f"# {line}\n" for line in _remarks(solution))
    rows = csv.writer(text)
    rows.writerow(header)
    rows.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
    write_file(path, text.getvalue().encode("utf-8"))


def _remarks(solution: Solution) -> Iterator[str]:
    """What a file says of its origin."""
    problem, verification = solution.problem, solution.verification
    unit = objective_unit(problem)
    yield f"problem: {problem.name}"
    yield f"objective: {with_unit(repr(solution.objective), unit)}"
    yield f"verdict: {solution.verdict}"
    yield f"end-state error of the replay: {verification.miss:.3g} of the scale of the states"
    yield f"largest violation of a constraint: {verification.excess:.3g} of its scale"
    numbers = {**solution.trajectory.constants, **solution.trajectory.unknowns}
    for symbol in (*problem.constants, *problem.unknowns):
        yield f"{symbol.name}: {with_unit(repr(numbers[symbol.name]), symbol.unit)}"
    yield f"written by: antenna-ocp {version('antenna-ocp')}"


def summary(solution: Solution) -> str:
    """At most ten lines: objective, verdict, time, mesh iterations, errors, unknowns and peaks."""
    width = max(len(what) for what, _ in _lines(solution))
    lines = [f"  {what:<{width}}  {text}" for what, text in _lines(solution)]
    return "\n".join([f"Solution of '{solution.problem.name}'", *lines])


def _lines(solution: Solution) -> Iterator[tuple[str, str]]:
    problem, phases = solution.problem, solution.trajectory.phases
    sense = "minimum" if problem.sense > 0 else "maximum"
    yield sense, with_unit(f"{solution.objective:.10g}", objective_unit(problem))
    yield "verdict", solution.verdict

    span = f"{phases[0].start:.6g} to {max(phase.end for phase in phases):.6g} s"
    count = sum(phase.intervals for phase in phases)
    in_phases = f" in {len(phases)} phases" if len(phases) > 1 else ""
    yield "time", f"{span}, {count} intervals{in_phases}{_times_at_limits(solution)}"
    yield (
        "solved in",
        f"{_counted(len(solution.mesh_iterations), 'mesh iteration')}, "
        f"{_counted(solution.iterations, 'iteration')}, {solution.seconds:.3g} s",
    )
    yield "worst error", _errors(solution)

    unknowns = {u.name: u.unit for u in problem.unknowns}
    if unknowns:
        values = solution.trajectory.unknowns
        yield (
            "unknowns",
            _listed([with_unit(f"{n} = {values[n]:.6g}", unknowns[n]) for n in unknowns]),
        )
    if problem.peaks:
        pairs = zip(problem.peaks, solution.trajectory.peaks, strict=True)
        yield "peaks", _listed([with_unit(f"{p.name} = {v:.6g}", p.unit) for p, v in pairs])


def _times_at_limits(solution: Solution) -> str:
    """The ends of phases that lie at a limit which was stated for them."""
    texts = []
    for phase, motion in zip(solution.problem.phases, solution.trajectory.phases, strict=True):
        if isinstance(phase.end, Between):
            near = _AT_LIMIT * (motion.end - motion.start)
            sides = {"lower": phase.end.lower, "upper": phase.end.upper}
            at = [side for side, limit in sides.items() if abs(motion.end - limit) <= near]
            texts += [f"the end of '{phase.name}' is at its {side} limit" for side in at]
    return "; " + _listed(texts) if texts else ""


def _errors(solution: Solution) -> str:
    """The worst errors, as parts of the sizes of what they are errors of."""
    verification = solution.verification
    if not solution.replay.phases:
        return "not verified"
    return (
        f"replayed end {verification.miss:.1e}, constraints {max(verification.excess, 0.0):.1e}, "
        f"dynamics {verification.dynamics:.1e} (relative)"
    )


def _listed(texts: list[str]) -> str:
    shown = ", ".join(texts[:_MOST_NUMBERS])
    more = len(texts) - _MOST_NUMBERS
    return f"{shown} and {more} more" if more > 0 else shown


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"
