"""What came of the starts of an audit: trials, and the distinct optima among them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ocp.optimality.iterate import LEAST_OF_A_SCALE
from ocp.settings import Settings
from ocp.solution.solution import Solution

_SAME_PATH = 1e-2  # of the states' sizes, within which two motions count as one
_SAME_VALUE = 10.0  # tolerances on the objective, within which two values count as one
_SAMPLES = np.linspace(0.0, 1.0, 201)


@dataclass(frozen=True, eq=False, repr=False)
class Trial:
    """What came of one start.

    Attributes
    ----------
    name : str
    solution : Solution or None
        Also where it is not verified.
    error : Exception or None
        Why there is no verified solution.
    value : float
        What is compared, nan without a solution.
    seconds : float
        That it took [s].
    """

    name: str
    solution: Solution | None
    error: Exception | None
    value: float
    seconds: float

    @property
    def solved(self) -> Solution:
        """The solution of a trial that has one."""
        assert self.solution is not None
        return self.solution

    @property
    def rank(self) -> float:
        """The value as it is minimised."""
        return self.solved.problem.sense * self.value

    @property
    def reason(self) -> str:
        """The kind of the error and its sentence, "" if there is none."""
        return f"{type(self.error).__name__}: {self.error}" if self.error else ""

    def __repr__(self) -> str:
        outcome = f"{self.value:.10g}" if self.solution else "failed"
        reason = f" ({self.reason})" if self.error else ""
        return f"Trial('{self.name}': {outcome}, {self.seconds:.3g} s{reason})"


@dataclass(frozen=True, eq=False, repr=False)
class Optimum:
    """One of the distinct optima.

    Attributes
    ----------
    solution : Solution
    starts : tuple of str
        Names of the starts that ended here.
    distance : float
        Of its states from the best motion's, largest over time, relative to their sizes; infinite
        where the phases are others.
    value : float
        What was compared.
    """

    solution: Solution
    starts: tuple[str, ...]
    distance: float
    value: float

    @property
    def objective(self) -> float:
        """Value of the objective, in the user's sense."""
        return self.solution.objective

    def __repr__(self) -> str:
        names = ", ".join(self.starts)
        return f"{self.value:.10g} from {len(self.starts)} ({names}), {self.distance:.2g} away"


def distinct_optima(
    trials: Sequence[Trial], settings: Settings, same: float | None
) -> tuple[Optimum, ...]:
    """The distinct optima, the best one first, each with the starts that ended there."""
    order = [trial.name for trial in trials]
    groups: list[list[Trial]] = []
    for trial in sorted(trials, key=lambda trial: trial.rank):
        for group in groups:
            if _same_optimum(trial, group[0], settings, same):
                group.append(trial)
                break
        else:
            groups.append([trial])

    best = groups[0][0]
    return tuple(
        Optimum(
            group[0].solved,
            tuple(sorted((trial.name for trial in group), key=order.index)),
            distance(group[0].solved, best.solved),
            group[0].value,
        )
        for group in groups
    )


def _same_optimum(one: Trial, other: Trial, settings: Settings, same: float | None) -> bool:
    if not same_value(one, other, settings, same):
        return False
    return same is not None or distance(one.solved, other.solved) <= _SAME_PATH


def same_value(one: Trial, other: Trial, settings: Settings, same: float | None) -> bool:
    """Whether two values are the same, to the accuracy of the settings or to what is asked for."""
    least = LEAST_OF_A_SCALE * one.solved.kept_iterate.scales.objective
    size = max(abs(one.value), abs(other.value), least)
    allowed = _SAME_VALUE * settings.accuracy.objective if same is None else same
    return abs(one.value - other.value) <= allowed * size


def distance(one: Solution, other: Solution) -> float:
    """Largest distance of two motions at equal fractions of their phases, relative to sizes."""
    scales = one.kept_iterate.scales
    phases = one.trajectory.phases, other.trajectory.phases
    if [(p.name, p.states) for p in phases[0]] != [(p.name, p.states) for p in phases[1]]:
        return math.inf
    most = 0.0
    for a, b in zip(*phases, strict=True):
        first, second = a.at_fractions(_SAMPLES), b.at_fractions(_SAMPLES)
        for name in a.states:
            gap = float(np.abs(first[name] - second[name]).max()) / scales.signals[name]
            most = max(most, gap)
        most = max(most, abs((a.end - a.start) - (b.end - b.start)) / scales.time)
    return most
