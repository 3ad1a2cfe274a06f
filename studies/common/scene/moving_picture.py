"""What moves on the page: points and lines against a parameter, and the parameter against time.

The geometry is a table against the parameter of the mechanism, which serves every law. Between two
rows, as between two instants of a law, a cubic with the stored slopes is meant (Hermite).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ocp.arrays import Array


@dataclass(frozen=True, eq=False)
class Strand:
    """Lines of one kind between points, (m, 2) indices."""

    kind: str
    pairs: Array


@dataclass(frozen=True, eq=False)
class RopeTension:
    """Ropes along points, and the tension of their segments.

    Attributes
    ----------
    paths : (ropes, segments + 1) indices of points.
    exponents : (segments, 2): segment k bears T1 exp(c_0 + c_1 p) at the parameter p.
    """

    paths: Array
    exponents: Array


@dataclass(frozen=True, eq=False)
class LawOfMotion:
    """How a law moves the parameter.

    Attributes
    ----------
    name : of the law.
    times, values, rates : (m,) [s], the parameter and its rate.
    force, rope_length : (m,) of one rope [N], [m]; empty where there is no rope.
    """

    name: str
    times: Array
    values: Array
    rates: Array
    force: Array = field(default_factory=lambda: np.empty(0))
    rope_length: Array = field(default_factory=lambda: np.empty(0))

    def at(self, time: float) -> float:
        """The parameter at a time [s]."""
        return float(hermite(self.times, self.values, self.rates, time))


@dataclass(frozen=True, eq=False)
class MovingPicture:
    """A mechanism in motion.

    Attributes
    ----------
    title : what it is.
    shapes : (k, p, 3) [m]; the points are sum_k w_k shapes[k], or, where there are no weights, a
        row between two of these.
    parameter : (r,) its values.
    weights, slopes : (r, k) weights w at these values and their slopes, or None.
    strands : what is drawn.
    centre : index of the point that stays in the middle of the picture, or -1.
    laws : the result's own first.
    tension : of the ropes, if there are any.
    slack : kinds of lines that are slack below a value of the parameter.
    size : largest extent [m].
    straight : (k, p, 3) [m], the points without their bending, if that can be exaggerated.
    flat : whether the motion is in the plane z = 0.
    """

    title: str
    shapes: Array
    parameter: Array
    strands: tuple[Strand, ...]
    laws: tuple[LawOfMotion, ...]
    weights: Array | None = None
    slopes: Array | None = None
    centre: int = -1
    tension: RopeTension | None = None
    slack: Mapping[str, float] = field(default_factory=dict)
    size: float = 1.0
    straight: Array | None = None
    flat: bool = False

    def points(self, value: float) -> Array:
        """Positions (p, 3) [m] at a value of the parameter, as the page works them out."""
        if self.weights is None or self.slopes is None:
            i, share = bracket(self.parameter, value)
            return np.asarray((1 - share) * self.shapes[i] + share * self.shapes[i + 1])
        weights = hermite(self.parameter, self.weights, self.slopes, value)
        return np.tensordot(weights, self.shapes, axes=1)


def hermite(places: Array, values: Array, slopes: Array, at: float) -> Array:
    """Cubic between two rows of a table, (k,), held at its ends."""
    i, s = bracket(places, at)
    step = places[i + 1] - places[i]
    return np.asarray(
        (1 + 2 * s) * (1 - s) ** 2 * values[i]
        + s**2 * (3 - 2 * s) * values[i + 1]
        + step * s * (1 - s) * ((1 - s) * slopes[i] - s * slopes[i + 1])
    )


def bracket(places: Array, at: float) -> tuple[int, float]:
    """Row below a place, and how far it is on the way to the next one, from 0 to 1."""
    at = min(max(at, places[0]), places[-1])
    i = min(max(int(np.searchsorted(places, at, side="right")) - 1, 0), len(places) - 2)
    return i, float((at - places[i]) / (places[i + 1] - places[i]))
