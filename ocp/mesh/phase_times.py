"""Times of phases in a guess: in the order of the phases, and drawn at random.

Where a free time states no guess, the middle of its limits serves. Middles of phases that follow
each other need not be in order: three phases that meet anywhere between 0 and 5 s would all meet
at 2.5 s, and end at 1 s. Times without a guess are then spread evenly between the others.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ocp.arrays import Array
from ocp.mesh.mesh import distinct
from ocp.problem.phase import Phase
from ocp.problem.symbols import Between

Ends = tuple[float, float]
Time = float | Between

# Factor by which drawn times are stretched or shortened at most, and the same of the part that
# a phase has of all.
_FASTER = 2.0
_SHARES = 4.0
_SHORTEST = 1e-6  # of the longest duration, that a phase keeps


def guessed_times(phases: Sequence[Phase]) -> dict[str, Ends]:
    """Initial and final time of each phase by name, where a solver starts [s]."""
    times: dict[str, Ends] = {}
    for chain in _chains(phases):
        stated = [chain[0].start, *(phase.end for phase in chain)]
        values = _in_order(stated)
        times |= {p.name: ends for p, ends in zip(chain, itertools.pairwise(values), strict=True)}
    return times


def knots_of(times: Mapping[str, Ends]) -> Array:
    """All times at which a phase begins or ends, in order."""
    return distinct(np.array([value for ends in times.values() for value in ends]))


def drawn_times(
    phases: Sequence[Phase], guessed: Mapping[str, Ends], random: np.random.Generator
) -> dict[str, Ends]:
    """Times about guessed ones, with other parts for each phase; known times stay.

    A free last time is guessed ones stretched, or anywhere within its limits, every other time. A
    free first time is anywhere within its limits as often, where both are finite.
    """
    knots = knots_of(guessed)
    stretch = float(np.exp(random.uniform(-1.0, 1.0) * np.log(_FASTER)))
    first = _anywhere(phases[0].start, float(knots[0]), random)
    end = first + stretch * float(knots[-1] - knots[0])
    last = _anywhere(phases[-1].end, end, random)
    weights = np.ones(knots.size - 1)
    if weights.size > 1:
        weights = np.exp(random.uniform(-1.0, 1.0, weights.size) * np.log(_SHARES))
    return _moved(phases, guessed, (first, last), weights)


def _anywhere(time: Time, otherwise: float, random: np.random.Generator) -> float:
    """A free time anywhere within finite limits, every other time, else what is given."""
    if not isinstance(time, Between) or not math.isfinite(time.upper - time.lower):
        return otherwise
    drawn, coin = random.uniform(time.lower, time.upper), random.random()
    return float(drawn) if coin < 0.5 else otherwise


def meet_freely(phases: Sequence[Phase]) -> bool:
    """Whether a phase begins at a free time after another one."""
    return any(isinstance(phase.start, Between) for phase in phases[1:])


def _moved(
    phases: Sequence[Phase], times: Mapping[str, Ends], ends: Ends, weights: Array
) -> dict[str, Ends]:
    """Times of which the pieces between two knots have other lengths.

    Parameters
    ----------
    ends : of all, where they are free [s].
    weights : (K - 1,) of the pieces between K knots. Between known times, parts change with it.
    """
    known = {
        value
        for phase in phases
        for time, value in zip((phase.start, phase.end), times[phase.name], strict=True)
        if not isinstance(time, Between)
    }
    knots, last = knots_of(times), len(weights)
    pieces = np.diff(knots) * weights
    held = sorted({0, last, *(k for k in range(last + 1) if float(knots[k]) in known)})

    moved = knots.copy()
    for k, end in ((0, ends[0]), (last, ends[1])):
        moved[k] = knots[k] if float(knots[k]) in known else end
    shortest = _SHORTEST * float(knots[-1] - knots[0])
    for a, b in itertools.pairwise(held):
        passed = pieces[a:b].cumsum()
        length = max(moved[b] - moved[a], shortest)
        moved[a + 1 : b + 1] = moved[a] + length * passed / passed[-1]
    by_knot = dict(zip(knots.tolist(), moved.tolist(), strict=True))
    return {phase.name: _ends(phase, times[phase.name], by_knot, shortest) for phase in phases}


def _ends(phase: Phase, ends: Ends, moved: Mapping[float, float], shortest: float) -> Ends:
    """Moved times of a phase within its limits, the last one after the first one."""
    start, end = (
        min(max(moved[value], time.lower), time.upper) if isinstance(time, Between) else value
        for time, value in zip((phase.start, phase.end), ends, strict=True)
    )
    return start, max(end, start + shortest)


def _chains(phases: Sequence[Phase]) -> Iterator[list[Phase]]:
    """Phases in runs in which each begins when the one before it ends."""
    chain = list(phases[:1])
    for before, phase in itertools.pairwise(phases):
        if before.end != phase.start:
            yield chain
            chain = []
        chain.append(phase)
    yield chain


def _in_order(stated: Sequence[Time]) -> list[float]:
    """Guesses of times that follow each other; those that say nothing make room for the others."""
    values = [time.start if isinstance(time, Between) else float(time) for time in stated]
    if all(a < b for a, b in itertools.pairwise(values)):
        return values
    says = [not isinstance(time, Between) or time.guess is not None for time in stated]
    said = [value for value, one in zip(values, says, strict=True) if one]
    first, last = stated[0], stated[-1]
    if not says[0] and isinstance(first, Between) and said and values[0] >= said[0]:
        values[0] = 0.5 * (first.lower + said[0])
    if not says[-1] and isinstance(last, Between) and said and values[-1] <= said[-1]:
        values[-1] = 0.5 * (said[-1] + last.upper)

    anchors = [0, *(k for k in range(1, len(values) - 1) if says[k]), len(values) - 1]
    spread = np.interp(np.arange(len(values)), anchors, [values[k] for k in anchors])
    return [
        min(max(float(value), time.lower), time.upper) if isinstance(time, Between) else value
        for time, value in zip(stated, spread.tolist(), strict=True)
    ]
