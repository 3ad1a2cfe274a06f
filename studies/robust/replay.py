"""One law on many trusses: forces along the motion, and how often a limit is broken.

A draw's peak is searched among samples, which hold every kink of the law, and then among finer ones
between the neighbours of the highest sample, at 1/16 of the spacing. What a smooth peak keeps
between those is of second order in the spacing, so 256 times less than between the first ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array
from studies.robust.config import VARIED, RobustTrussStudy
from studies.robust.kernel import force_kernel
from studies.truss.motions.deployment import Deployment

SAMPLES = 400  # of a motion, at least; each piece has four or more
FINER = 33  # samples between the neighbours of the highest one
BLOCK = 250  # draws in memory at the same time
BAND_TIMES = 201
BAND = (5.0, 95.0)  # per cent


@dataclass(frozen=True, eq=False)
class Replay:
    """What a law needs of many trusses.

    Attributes
    ----------
    peak, least : largest rope force and least tension of each truss, shape (k,) [N].
    time : of the band, shape (m,) [s].
    low, high : of the force over time, 5 and 95 % of the trusses, shape (m,) [N].
    """

    peak: Array
    least: Array
    time: Array
    low: Array
    high: Array


def drawn(study: RobustTrussStudy) -> Array:
    """Values of `VARIED` of each truss that is drawn, shape (draws, len(VARIED))."""
    asked = study.uncertainty
    generator = np.random.default_rng(asked.seed)
    words = list(VARIED)
    values = np.tile(study.values_of({}), (asked.draws, 1))
    for word, shape in sorted(asked.scatter.items()):
        values[:, words.index(word)] = _column(generator, shape, asked.draws)
    return values


def _column(generator: np.random.Generator, shape: Mapping[str, float], count: int) -> Array:
    if "low" in shape:
        return generator.uniform(shape["low"], shape["high"], count)
    column = generator.normal(shape["mean"], shape["deviation"], count)
    while (negative := column < 0.0).any():  # cut off at zero: drawn again
        column[negative] = generator.normal(shape["mean"], shape["deviation"], negative.sum())
    return column


def replay(
    deployment: Deployment, values: Array, tell: Callable[[str], None] = lambda line: None
) -> Replay:
    """Forces of trusses with values (k, len(VARIED)) that all move by the deployment's law."""
    time = times_of(deployment)
    columns = np.unique(np.linspace(0, time.size - 1, BAND_TIMES).round().astype(int))
    peak, least = np.empty(len(values)), np.empty(len(values))
    history = np.empty((len(values), columns.size), dtype=np.float32)

    for begin in range(0, len(values), BLOCK):
        block = slice(begin, begin + BLOCK)
        force, far = forces(deployment, np.tile(time, (len(values[block]), 1)), values[block])
        tension = np.minimum(force, far)
        history[block] = force[:, columns]
        for found, sign, rows in ((peak, 1.0, force), (least, -1.0, tension)):
            close = forces(deployment, closer(time, (sign * rows).argmax(axis=1)), values[block])
            finer = sign * (close[0] if sign > 0 else np.minimum(*close))
            found[block] = sign * np.maximum((sign * rows).max(axis=1), finer.max(axis=1))
        if (begin // BLOCK) % 10 == 9:
            tell(f"{deployment.name}: {begin + BLOCK} of {len(values)} trusses")
    low, high = np.percentile(history, BAND, axis=0)
    return Replay(peak, least, time[columns], low, high)


def forces(deployment: Deployment, time: Array, values: Array) -> tuple[Array, Array]:
    """Forces at the motor and tensions at the far end, (k, m), at times (k, m) of k trusses.

    Parameters
    ----------
    values : of `VARIED`, (k, len(VARIED)), or (k, m, len(VARIED)) where they change along the way.
    """
    motion = deployment.law.motion(time.ravel())
    rows = (motion.angle, np.maximum(motion.speed, 0.0), motion.acceleration)
    kernel = force_kernel(deployment.truss, "by angle").map(time.size)
    if values.ndim == 2:
        values = np.repeat(values[:, None], time.shape[1], axis=1)
    found = kernel(*(row[None] for row in rows), values.reshape(-1, len(VARIED)).T)
    force, far = (row.full().reshape(time.shape) for row in found)
    return force, far


def times_of(deployment: Deployment) -> Array:
    """Times of a motion (m,): even within each piece, both sides of every kink among them."""
    edges = np.array(deployment.edges)
    share = np.diff(edges) / edges[-1]
    pieces = [
        np.linspace(a, b, max(4, round(SAMPLES * s)))
        for a, b, s in zip(edges[:-1], edges[1:], share, strict=True)
    ]
    return np.unique(np.concatenate([*pieces, np.nextafter(edges[1:], 0.0)]))


def closer(time: Array, highest: Array) -> Array:
    """Finer times between the neighbours of samples (k,), shape (k, FINER)."""
    low, high = time[np.maximum(highest - 1, 0)], time[np.minimum(highest + 1, time.size - 1)]
    return low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, FINER)
