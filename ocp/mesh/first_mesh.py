"""The first mesh of a phase, finer where the stated guess moves fast.

A uniform mesh cannot carry a guess that waits for a long time and then moves within a few
intervals: between the points of the mesh the motion is lost, and the solver starts from something
else. There the intervals share out the way that the guess goes, in time and in its states.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocp.arrays import Array
from ocp.mesh.initial_guess import PhaseGuess
from ocp.mesh.mesh import PhaseMesh

# A guess that strays further from straight lines between the points, relative to its range, is one
# that the mesh cannot carry: a uniform mesh, and one that follows it.
_LOST = 0.1
_KEPT = 0.02
_TIMES_AS_MANY = (1, 2, 4)
_EVENLY = np.linspace(0.0, 1.0, 4001)


def following(
    mesh: PhaseMesh, guess: PhaseGuess, states: Sequence[str], fractions: Array = _EVENLY
) -> PhaseMesh:
    """The mesh, or one of the same degree that carries the guess better.

    Parameters
    ----------
    mesh : PhaseMesh
        A uniform one.
    guess : PhaseGuess
    states : sequence of str
        Names of the signals that the mesh has to carry.
    fractions : (m,)
        Of the phase, from 0 to 1, at which the guess is looked at.
    """
    lines = _relative(guess, states, fractions)
    if _strays(mesh, fractions, lines) <= _LOST:
        return mesh

    # half of the intervals follow these fractions, the others the states
    way = np.abs(np.diff(lines, axis=1)).sum(axis=0)
    evenly = np.linspace(0.0, 1.0, fractions.size)
    passed = evenly + np.concatenate([[0.0], np.cumsum(way) / way.sum()])
    for times in _TIMES_AS_MANY:
        shares = np.linspace(0.0, passed[-1], times * mesh.intervals + 1)
        points = np.interp(shares, passed, fractions)
        points[-1] = 1.0
        finer = PhaseMesh(points, mesh.degrees[:1])
        if _strays(finer, fractions, lines) <= _KEPT:
            break
    return finer


def carries(mesh: PhaseMesh, guess: PhaseGuess, states: Sequence[str], fractions: Array) -> bool:
    """Whether the mesh keeps the guess; the parameters are those of `following`."""
    return _strays(mesh, fractions, _relative(guess, states, fractions)) <= _LOST


def _relative(guess: PhaseGuess, states: Sequence[str], fractions: Array) -> Array:
    """States that move, relative to their ranges, (n, m)."""
    values = guess.at_fractions(fractions)
    lines = np.array([values[name] for name in states]).reshape(len(states), fractions.size)
    ranges = np.ptp(lines, axis=1)
    return np.asarray(lines[ranges > 0.0] / ranges[ranges > 0.0, None])


def _strays(mesh: PhaseMesh, fractions: Array, lines: Array) -> float:
    """How far the states are from straight lines between as many points as the mesh has."""
    degree = int(mesh.degrees[0])
    steps = np.diff(mesh.breakpoints)[:, None] * np.arange(degree) / degree
    points = np.append((mesh.breakpoints[:-1, None] + steps).ravel(), 1.0)
    strays = [
        np.interp(fractions, points, np.interp(points, fractions, line)) - line for line in lines
    ]
    return max((float(np.abs(stray).max()) for stray in strays), default=0.0)
