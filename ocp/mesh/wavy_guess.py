"""Wavy guesses: smooth random waves around a guess, inside all bounds, boundary values kept."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array
from ocp.mesh.initial_guess import InitialGuess, PhaseGuess, drawn_times
from ocp.problem.parameters import Parameters
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem

_WAVES = np.arange(4)  # cosines of half a period each, with amplitudes that fall as 1 / (1 + n)


def wavy_guess(
    problem: Problem,
    parameters: Parameters,
    around: InitialGuess,
    sizes: Mapping[str, float],
    unknown_sizes: Mapping[str, float],
    random: np.random.Generator,
) -> InitialGuess:
    """A guess of random waves, of other times and of other unknowns.

    Parameters
    ----------
    around : InitialGuess
        What the waves are added to.
    sizes, unknown_sizes : mapping of str to float
        Typical sizes of the signals and of the unknowns.
    """
    # the same draws in the same order, so that a seed means the same start
    guessed = {name: (phase.start, phase.end) for name, phase in around.phases.items()}
    times = drawn_times(problem.phases, guessed, random)
    phases: dict[str, PhaseGuess] = {
        phase.name: _wavy(problem, phase, around, sizes, parameters, times[phase.name], random)
        for phase in problem.phases
    }
    unknowns = {}
    for unknown in problem.unknowns:
        name, (lower, upper) = unknown.name, parameters.unknown_limits[unknown.name]
        # anywhere between limits that are finite, else around the guess
        if math.isfinite(upper - lower):
            unknowns[name] = float(random.uniform(lower, upper))
        else:
            wavy = around.unknowns[name] + unknown_sizes[name] * random.normal()
            unknowns[name] = float(min(max(wavy, lower), upper))
    return InitialGuess(phases, unknowns)


@dataclass(frozen=True, eq=False, repr=False)
class _WavyGuess:
    """The stated guess of a phase plus smooth waves.

    Attributes
    ----------
    limits : mapping of signal to (lower, upper)
    waves : mapping of signal to (4,)
        Amplitudes of the cosines.
    held : mapping of signal to (bool, bool)
        Whether its first and last value are prescribed: there the waves vanish.
    """

    stated: PhaseGuess
    start: float
    end: float
    limits: Mapping[str, tuple[float, float]]
    waves: Mapping[str, Array]
    held: Mapping[str, tuple[bool, bool]]

    def at_fractions(self, fractions: Array) -> Mapping[str, Array]:
        """Signals by name at fractions of the phase."""
        cosines = np.cos(np.pi * np.outer(_WAVES, fractions))
        values = {}
        for name, stated in self.stated.at_fractions(fractions).items():
            first, last = self.held[name]
            taper = (np.sqrt(fractions) if first else 1.0) * (np.sqrt(1 - fractions) if last else 1)
            wavy = stated + taper * (self.waves[name] @ cosines)
            values[name] = np.clip(wavy, *self.limits[name])
        return values


def _wavy(
    problem: Problem,
    phase: Phase,
    stated: InitialGuess,
    sizes: Mapping[str, float],
    parameters: Parameters,
    times: tuple[float, float],
    random: np.random.Generator,
) -> _WavyGuess:
    """Draw the waves of all signals of a phase."""
    signals, waves = problem.signals[phase.name], {}
    for signal in signals:
        # half the distance of limits where both are finite, the typical size elsewhere
        lower, upper = parameters.signal_limits[signal.name]
        bounded = math.isfinite(upper - lower)
        reach = 0.5 * (upper - lower) if bounded else sizes[signal.name]
        drawn = random.normal(size=_WAVES.size)
        waves[signal.name] = np.asarray(0.5 * reach * drawn / (1 + _WAVES))
    return _WavyGuess(
        stated=stated.phases[phase.name],
        start=times[0],
        end=times[1],
        limits={s.name: parameters.signal_limits[s.name] for s in signals},
        waves=waves,
        held={s.name: (s in phase.initial, s in phase.final) for s in signals},
    )
