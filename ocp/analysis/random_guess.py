"""Random starts: smooth waves around the stated guess, inside all bounds, boundary values kept."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocp.mesh.initial_guess import PhaseStart, Start, evaluate_limit, signals_of, start_of
from ocp.mesh.mesh import Mesh, uniform
from ocp.mesh.trajectory import Trajectory
from ocp.problem.statement import Phase, Problem
from ocp.problem.symbols import Between
from ocp.settings import Settings
from ocp.transcription.packing import decision_vector, trajectory_of
from ocp.transcription.scaling import Scales, scales_of
from ocp.transcription.transcribe import Method, transcribe

Array = NDArray[np.float64]
_WAVES = np.arange(4)  # cosines of half a period each, with amplitudes that fall as 1 / (1 + n)
_FASTER = 2.0  # free times are stretched or shortened by up to this factor


def random_trajectory(
    problem: Problem, settings: Settings, random: np.random.Generator
) -> Trajectory:
    """A random start of a problem, on the first mesh of its solve."""
    constants = {c.name: float(c.value) for c in problem.constants}
    stated = start_of(problem, constants)
    scales = scales_of(problem, stated, constants)
    stretch = float(np.exp(random.uniform(-1.0, 1.0) * np.log(_FASTER)))
    phases = {
        phase.name: _Wavy.around(problem, phase, stated, scales, constants, stretch, random)
        for phase in problem.phases
    }
    unknowns = {
        u.name: _drawn(
            stated.unknowns[u.name], _limits(u, constants), scales.unknowns[u.name], random
        )
        for u in problem.unknowns
    }
    mesh = Mesh(tuple(uniform(settings.intervals, settings.degree) for _ in problem.phases))
    made = transcribe(problem, mesh, Method(settings.scheme, settings.control_shape), scales)
    x = decision_vector(made, Start(phases, unknowns), constants)
    return trajectory_of(made, np.nan_to_num(x), constants)


@dataclass(frozen=True, eq=False)
class _Wavy:
    """The stated guess of a phase plus smooth waves, which vanish at prescribed boundary values."""

    stated: PhaseStart
    start: float
    end: float
    limits: Mapping[str, tuple[float, float]]
    waves: Mapping[str, Array]
    held: Mapping[str, tuple[bool, bool]]

    @classmethod
    def around(
        cls, problem: Problem, phase: Phase, stated: Start, scales: Scales,
        constants: Mapping[str, float], stretch: float, random: np.random.Generator,
    ) -> _Wavy:  # fmt: skip
        """Draw the waves of all signals of a phase."""
        own, signals = stated.phases[phase.name], signals_of(problem, phase)
        first = min(p.start for p in stated.phases.values())
        start, end = (
            _inside(first + stretch * (guess - first), (value.lower, value.upper))
            if isinstance(value, Between) else guess
            for value, guess in ((phase.start, own.start), (phase.end, own.end))
        )  # fmt: skip
        return cls(
            own, start, max(end, start + 1e-6 * scales.time),
            {s.name: _limits(s, constants) for s in signals},
            {s.name: 0.5 * _reach(s, scales.signals, constants) * random.normal(size=_WAVES.size)
             / (1 + _WAVES) for s in signals},
            {s.name: (s in phase.initial, s in phase.final) for s in signals},
        )  # fmt: skip

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]:
        """Signals by name at fractions of the phase."""
        cosines = np.cos(np.pi * np.outer(_WAVES, fractions))
        found = {}
        for name, values in self.stated.at_fractions(fractions).items():
            first, last = self.held[name]
            taper = (np.sqrt(fractions) if first else 1.0) * (np.sqrt(1 - fractions) if last else 1)
            found[name] = np.clip(values + taper * (self.waves[name] @ cosines), *self.limits[name])
        return found


def _limits(symbol: Any, constants: Mapping[str, float]) -> tuple[float, float]:
    return evaluate_limit(symbol.lower, constants), evaluate_limit(symbol.upper, constants)


def _drawn(
    stated: float, limits: tuple[float, float], size: float, random: np.random.Generator
) -> float:
    """Anywhere between limits that are finite, else around the stated guess."""
    if math.isfinite(limits[1] - limits[0]):
        return float(random.uniform(*limits))
    return _inside(stated + size * random.normal(), limits)


def _reach(symbol: Any, sizes: Mapping[str, float], constants: Mapping[str, float]) -> float:
    """Half the distance of a symbol's limits where both are finite, its typical size elsewhere."""
    lower, upper = _limits(symbol, constants)
    return 0.5 * (upper - lower) if math.isfinite(upper - lower) else sizes[symbol.name]


def _inside(value: float, limits: tuple[float, float]) -> float:
    return float(min(max(value, limits[0]), limits[1]))
