"""What is measured on a motion of flexible links: bending, vibration, frequencies.

Symbols: t times (m,) [s], q node vectors (size, m).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from models.ancf.analysis import natural_modes
from models.ancf.chain import Chain
from models.ancf.joints import Free, Joint, Torque
from models.ancf.state import posed
from models.errors import ModelError
from ocp.arrays import Array

DEGREE = 7  # of the polynomial for the slow part of a bending, without its vibration


def bending(chain: Chain, q: Array, link: int) -> Array:
    """Displacement of a link's end across the tangent at its start, (m,) [m]."""
    start, end = chain.slots(link, 0), chain.slots(link, -1)
    chord = q[list(end[:2])] - q[list(start[:2])]
    tangent = q[list(start[2:])]
    across = np.array([-tangent[1], tangent[0]]) / np.hypot(*tangent)
    return np.asarray((chord * across).sum(axis=0))


def _polynomials(t: Array) -> Array:
    return np.polynomial.chebyshev.chebvander(2 * (t - t[0]) / (t[-1] - t[0]) - 1, DEGREE)


def vibration(t: Array, history: Array) -> float:
    """Amplitude of what a slow change, a polynomial of the time, does not explain."""
    slow = _polynomials(t)
    rest = history - slow @ np.linalg.lstsq(slow, history, rcond=None)[0]
    return float(np.ptp(rest)) / 2


def fitted_frequency(t: Array, history: Array, guess: float) -> float:
    """Frequency [Hz] of the one sine that, with a slow change, fits a history best."""
    from scipy.optimize import minimize_scalar

    slow, width = _polynomials(t), 1.5 / (t[-1] - t[0])

    def left(frequency: float) -> float:
        turn = 2 * np.pi * frequency * t
        columns = np.column_stack([slow, np.cos(turn), np.sin(turn)])
        fit = columns @ np.linalg.lstsq(columns, history, rcond=None)[0]
        return float(((fit - history) ** 2).sum())

    # the misfit has many minima, as wide as the inverse of the time: the lowest is refined
    grid = np.linspace(guess - 2 * width, guess + 2 * width, 61)
    near = grid[np.argmin([left(f) for f in grid])]
    step = grid[1] - grid[0]
    return float(minimize_scalar(left, bounds=(near - step, near + step), method="bounded").x)


def pose_frequencies(
    chain: Chain, joints: Sequence[Joint], angles: Array, count: int, t: float
) -> tuple[Array, str]:
    """Natural frequencies [Hz] of the undeformed chain in a pose, without gravity.

    Returns
    -------
    frequencies : (count,) or fewer
    remark : why there are fewer; empty if there are not.
    """
    bare = dataclasses.replace(chain, gravity=(0.0, 0.0))
    state, remark = posed(bare, list(angles)), ""
    # a torque would bend the chain out of its pose, and changes no frequency by its own
    joints = [Free() if isinstance(joint, Torque) else joint for joint in joints]
    for asked in range(count, 0, -1):
        try:
            modes = natural_modes(bare, joints, state, count=asked, t=t)
        except ModelError as error:
            remark = remark or str(error)
            continue
        return modes.frequencies, remark
    return np.empty(0), remark
