"""The choices on which sides of known times phases begin and end, with times for each choice.

A known time is one at which expressions step or bend. Between two of these a free time may lie
anywhere: it is put in the middle there, or evenly where several are in the same place. Where the
choices are few, it is also put near both ends.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ocp.arrays import Array
from ocp.mesh.phase_times import Ends, Time, knots_of
from ocp.problem.phase import Phase
from ocp.problem.symbols import Between

# Choices that are looked through where there are more
_MOST = 20_000

# Durations by which a time without a limit may be beyond the known ones
_BEYOND = 2.0

# Where a time is put in its place: in the middle, early and late
_PARTS = (0.5, 0.15, 0.85)

# Lower and upper limit of a time, and the number of known times before it
_Place = tuple[float, float, int]


def side_choices(
    phases: Sequence[Phase],
    instants: Mapping[str, Sequence[float]],
    guessed: Mapping[str, Ends],
    most: int,
) -> list[dict[str, Ends]]:
    """Times of phases on this and the other sides of the known times, evenly out of all choices.

    Those in the middle of their places come first.

    Parameters
    ----------
    phases : sequence of Phase
    instants : mapping of str to sequence of float
        Known times of each phase [s].
    guessed : mapping of str to (float, float)
        Where each begins and ends in a guess. Times that are the same there stay so [s].
    most : int
        That are wanted at most.
    """
    knots = knots_of(guessed).tolist()
    duration = knots[-1] - knots[0]
    places = [_places(phases, instants, guessed, knot, duration) for knot in knots]
    choices = list(itertools.islice(_in_order(places), _MOST))
    found: list[dict[str, Ends]] = []
    for part in _PARTS:
        drawn = [_times(chosen, part) for chosen in choices]
        drawn = [times for times in drawn if all(a < b for a, b in itertools.pairwise(times))]
        left = most - len(found)
        for k in np.linspace(0, len(drawn) - 1, min(len(drawn), left)).round().astype(int):
            at = dict(zip(knots, drawn[k], strict=True))
            found.append({name: (at[start], at[end]) for name, (start, end) in guessed.items()})
    return found


def _places(
    phases: Sequence[Phase],
    instants: Mapping[str, Sequence[float]],
    guessed: Mapping[str, Ends],
    knot: float,
    duration: float,
) -> list[_Place]:
    """Where a time at which phases begin or end may be: between which known times, in order."""
    lower, upper, known = -math.inf, math.inf, set[float]()
    for phase in phases:
        for time, at in zip((phase.start, phase.end), guessed[phase.name], strict=True):
            if at == knot:
                low, high = _limits(time)
                lower, upper = max(lower, low), min(upper, high)
                known |= set(instants[phase.name])
    every = np.array(sorted(known))
    if not lower < upper:
        return [(knot, knot, int(np.searchsorted(every, knot)))]
    first, last = every[[0, -1]] if known else (knot, knot)
    if not math.isfinite(lower):
        lower = min(first, upper) - _BEYOND * duration
    if not math.isfinite(upper):
        upper = max(last, lower) + _BEYOND * duration
    return _between(float(lower), float(upper), every)


def _limits(time: Time) -> Ends:
    """Limits of a time [s]."""
    return (time.lower, time.upper) if isinstance(time, Between) else (float(time), float(time))


def _between(lower: float, upper: float, known: Array) -> list[_Place]:
    """The parts of the limits of a time between known ones."""
    ends = [lower, *known[(known > lower) & (known < upper)].tolist(), upper]
    return [
        (low, high, int(np.searchsorted(known, 0.5 * (low + high))))
        for low, high in itertools.pairwise(ends)
    ]


def _in_order(places: Sequence[Sequence[_Place]]) -> Iterator[tuple[_Place, ...]]:
    """One place for each time, none before that of the time before it."""
    if not places:
        yield ()
        return
    for place in places[0]:
        behind = [[p for p in others if p[1] > place[0]] for others in places[1:]]
        yield from ((place, *rest) for rest in _in_order(behind))


def _times(chosen: Sequence[_Place], part: float) -> list[float]:
    """Times at a part of their places; several between the same known times are spread over it."""
    times: list[float] = []
    for _, group in itertools.groupby(chosen, key=lambda place: place[2]):
        together = list(group)
        for number, (low, high, _) in enumerate(together, start=1):
            before, behind = (number - 1) / len(together), number / len(together)
            times.append(low + (high - low) * (before + part * (behind - before)))
    return times
