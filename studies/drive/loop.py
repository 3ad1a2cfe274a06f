"""The position loop as a low-pass of second order, exact for a piecewise polynomial command.

    y'' + 2 zeta w y' + w^2 y = w^2 u

Within a piece u is a polynomial, and so is one solution p. What is left, y - p, decays freely. Only
its state is carried from piece to piece.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ocp.arrays import Array

SETTLED = 12.0  # time constants after which what is left is e^-12 of it
RESPONSE_POINTS = 200_001  # of an impulse response, for its integral
FINEST = 0.25  # of the loop's time constant 1/w: spacing of samples that miss no peak


@dataclass(frozen=True)
class Loop:
    """A position loop, or another low-pass of second order.

    Attributes
    ----------
    frequency : w, natural frequency [rad/s].
    damping : zeta.
    """

    frequency: float
    damping: float

    @property
    def settling(self) -> float:
        """Time until a step is followed [s]."""
        z = self.damping
        slowest = z if z <= 1.0 else z - math.sqrt(z**2 - 1.0)
        return SETTLED / (slowest * self.frequency)

    @functools.cached_property
    def overshoot(self) -> float:
        """Integral of the impulse response's modulus: the most a bounded command is magnified."""
        time, response, _ = self._responses
        return float(np.trapezoid(np.abs(response), time))

    @functools.cached_property
    def curvature(self) -> float:
        """Acceleration for each unit of a bounded error of the position [1/s^2], the most."""
        time, _, direct = self._responses
        return self.frequency**2 * (1.0 + float(np.trapezoid(np.abs(direct), time)))

    def impulses(self, step: float) -> float:
        """The most that impulses at intervals of `step` add up to, times the step."""
        time, response, _ = self._responses
        # fine beside both the step and the loop's own time
        fine = math.ceil(max(200.0, 100.0 * min(step, self.settling) * self.frequency))
        phases = np.linspace(0.0, min(step, self.settling), fine)
        count = math.ceil(float(time[-1]) / step) + 1
        hits = phases[:, None] + step * np.arange(count)
        sums = np.interp(hits, time, np.abs(response), right=0.0).sum(axis=1)
        return float(step * sums.max())

    @functools.cached_property
    def _responses(self) -> tuple[Array, Array, Array]:
        """Times, the impulse response of y by u, and that of y'' by u without its impulse / w^2."""
        time = np.linspace(0.0, self.settling, RESPONSE_POINTS)
        free = _decays(self.frequency, self.damping, time)
        # position and speed after an impulse w^2 on the speed
        position, speed = self.frequency**2 * free[0, 1], self.frequency**2 * free[1, 1]
        return time, position, position + 2 * self.damping / self.frequency * speed


def _decays(w: float | Array, z: float, time: Array) -> Array:
    """The matrix exponential of the free loop, (2, 2, m)."""
    fade = np.exp(-z * w * time)
    if z < 1.0:
        d = w * math.sqrt(1.0 - z**2)
        c, s = fade * np.cos(d * time), fade * np.sin(d * time) / d
    elif z == 1.0:
        c, s = fade, fade * time
    else:
        d = w * math.sqrt(z**2 - 1.0)
        # apart, so that no huge number is multiplied by a tiny one
        fast, slow = np.exp((-z * w - d) * time), np.exp((-z * w + d) * time)
        c, s = (slow + fast) / 2, (slow - fast) / (2 * d)
    return np.stack([np.stack([c + z * w * s, s]), np.stack([-(w**2) * s, c - z * w * s])])


@dataclass(frozen=True, eq=False)
class Followed:
    """What a loop makes of a command, from rest at the command's first position or under way.

    Attributes
    ----------
    frequency, damping : w of each piece (m,) [rad/s], and zeta.
    edges : times of the pieces (m + 1,) [s].
    particular : coefficients of p in each piece, constant first, (k, m).
    deviations : state of y - p at the start of each piece, (2, m).
    """

    frequency: Array
    damping: float
    edges: Array
    particular: Array
    deviations: Array

    def derivatives(self, time: Array, count: int = 4) -> Array:
        """Position, velocity and so on at times (n,): as many rows as asked for, (count, n)."""
        last = self.edges.size - 2
        piece = np.clip(np.searchsorted(self.edges, time, side="right") - 1, 0, last)
        dt = time - self.edges[piece]

        w, z = self.frequency[piece], self.damping
        state = np.einsum("ijn,jn->in", _decays(w, z, dt), self.deviations[:, piece])
        free = [state[0], state[1]]
        for _ in range(count - 2):  # the homogeneous equation gives each next derivative
            free.append(-2 * z * w * free[-1] - w**2 * free[-2])

        rows, coefficients = [], self.particular
        for order in range(count):
            rows.append(free[order] + _value(coefficients, piece, dt))
            coefficients = _derived(coefficients)
        return np.stack(rows)


def followed(curve: Any, loop: Loop, end: float, under_way: bool = False) -> Followed:
    """What a loop makes of a SciPy piecewise polynomial, and of a rest behind it until it settles.

    Parameters
    ----------
    end : position of that rest; a command that holds its positions never shows the last one.
    under_way : whether the axis follows already at the start; else it rests at the first position.
    """
    coefficients = np.asarray(curve.c)[::-1]
    edges = np.asarray(curve.x, dtype=float)
    still = np.zeros((coefficients.shape[0], 1))
    still[0] = end
    coefficients = np.concatenate([coefficients, still], axis=1)
    edges = np.append(edges, edges[-1] + loop.settling)
    frequency = np.full(edges.size - 1, loop.frequency)
    return followed_in_pieces(coefficients, edges, frequency, loop.damping, under_way)


def followed_in_pieces(
    coefficients: Array,
    edges: Array,
    frequency: Array,
    damping: float,
    under_way: bool = False,
) -> Followed:
    """What a low-pass makes of polynomial pieces, each with a natural frequency of its own.

    Parameters
    ----------
    coefficients : of the command in each piece, constant first, (k, m).
    edges : times of the pieces (m + 1,) [s].
    frequency, damping : w of each piece (m,) [rad/s], and zeta.
    under_way : whether there is nothing left to decay at the start; else it is at rest there.
    """
    particular = _particular(coefficients, frequency, damping)
    slopes = _derived(particular)
    steps = np.diff(edges)
    pieces = np.arange(steps.size)
    at_ends = np.stack([_value(rows, pieces, steps) for rows in (particular, slopes)])
    gaps = at_ends[:, :-1] - np.stack([particular[0], slopes[0]])[:, 1:]

    # x_(k+1) = exp(A dt_k) x_k + gap_k
    transitions = _decays(frequency, damping, steps).transpose(2, 0, 1).tolist()
    position, speed = float(coefficients[0, 0] - particular[0, 0]), float(-slopes[0, 0])
    if under_way:
        position, speed = 0.0, 0.0
    states = [(position, speed)]
    for ((a, b), (c, d)), (gap, jump) in zip(transitions, gaps.T.tolist(), strict=False):
        position, speed = a * position + b * speed + gap, c * position + d * speed + jump
        states.append((position, speed))
    return Followed(frequency, damping, edges, particular, np.array(states).T)


def _particular(command: Array, w: Array, z: float) -> Array:
    """The polynomial p with p'' + 2 zeta w p' + w^2 p = w^2 u in each piece."""
    solution = np.zeros_like(command)
    for k in range(command.shape[0] - 1, -1, -1):
        solution[k] = command[k]
        if k + 1 < command.shape[0]:
            solution[k] -= 2 * z / w * (k + 1) * solution[k + 1]
        if k + 2 < command.shape[0]:
            solution[k] -= (k + 1) * (k + 2) / w**2 * solution[k + 2]
    return solution


def _derived(coefficients: Array) -> Array:
    """Coefficients of the derivative, constant first."""
    if coefficients.shape[0] == 1:
        return np.zeros_like(coefficients)
    orders = np.arange(1, coefficients.shape[0])[:, None]
    return coefficients[1:] * orders


def _value(coefficients: Array, piece: Any, dt: Array) -> Array:
    """Horner's form of the pieces' polynomials."""
    total = np.zeros_like(dt)
    for row in coefficients[::-1]:
        total = total * dt + row[piece]
    return total
