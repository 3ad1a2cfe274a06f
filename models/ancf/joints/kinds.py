"""The four kinds of joint: left free, given a torque, locked, or driven along an angle.

The joint angle phi is counter-clockwise from the end slope of the link before (the x axis at
the root) to the start slope of the link after [rad]; a torque [N m] acts on the latter and
its opposite on the former.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeAlias, TypeVar

import numpy as np

from models.ancf.chain import Chain
from models.arrays import Array
from models.errors import ModelError, require

TimeFunction: TypeAlias = Callable[[Array], Array]
"""Maps times (m,) [s] to values (m,)."""
_T = TypeVar("_T")


@dataclass(frozen=True)
class Free:
    """A hinge without torque."""

    breakpoints: tuple[float, ...] = ()


@dataclass(frozen=True)
class Torque:
    """A hinge with a given torque.

    Parameters
    ----------
    torque : callable
        Times (m,) [s] to torques (m,) [N m]; smooth between breakpoints.
    breakpoints : tuple of float
        Times at which it or a derivative jumps [s]; the integration restarts there.
    """

    torque: TimeFunction
    breakpoints: tuple[float, ...] = ()


@dataclass(frozen=True)
class Locked:
    """A hinge locked at an angle [rad]; at the root, a clamp."""

    angle: float
    breakpoints: tuple[float, ...] = ()

    def law(self, t: Array) -> tuple[Array, Array, Array]:
        """Angle [rad], rate [rad/s] and acceleration [rad/s^2] at times (m,)."""
        return np.full_like(t, self.angle), np.zeros_like(t), np.zeros_like(t)


@dataclass(frozen=True)
class Driven:
    """A hinge that follows phi(t); the torque is the reaction.

    Parameters
    ----------
    angle, rate, acceleration : callable
        Times (m,) [s] to phi [rad] and its two derivatives [rad/s, rad/s^2].
    breakpoints : tuple of float
        Times at which the acceleration or a derivative of it jumps [s].
    """

    angle: TimeFunction
    rate: TimeFunction
    acceleration: TimeFunction
    breakpoints: tuple[float, ...] = ()

    def law(self, t: Array) -> tuple[Array, Array, Array]:
        """Angle [rad], rate [rad/s] and acceleration [rad/s^2] at times (m,)."""
        return self.angle(t), self.rate(t), self.acceleration(t)


Joint: TypeAlias = Free | Torque | Locked | Driven


class LastAsked(Generic[_T]):
    """A function of times that keeps what it gave last: Newton iterations ask for it again.

    They hand over the same array, which nobody may change.
    """

    def __init__(self, function: Callable[[Array], _T]) -> None:
        self._function = function
        self._last: tuple[Array, _T] | None = None

    def __call__(self, t: Array) -> _T:
        """The function at times (m,) [s]."""
        if self._last is None or self._last[0] is not t:
            self._last = t, self._function(t)
        return self._last[1]


def check_joints(chain: Chain, joints: Sequence[Joint]) -> tuple[Joint, ...]:
    """Raise ModelError unless there is one joint a link and a flying root is free."""
    require(
        len(joints) == len(chain.links),
        f"joints: {len(joints)} given for {len(chain.links)} links; give one a link, "
        "the root first.",
    )
    require(
        chain.pinned or isinstance(joints[0], Free),
        "joints: the root flies but is not Free; pin the chain to act on it.",
    )
    return tuple(joints)


def law_values(
    law: TimeFunction, times: Array, name: str = "simulate: the law of a joint", end: float = np.inf
) -> Array:
    """Values (m,) of a law at times (m,) [s], one finite number for each.

    `name` begins the sentence of the error, `end` is the end of the motion [s] if it is known.

    Raises
    ------
    ModelError
        If the law returns no numbers, another shape, or a value that is not finite.
    """
    returned = law(times)
    try:
        values = np.asarray(returned, dtype=float)
    except (TypeError, ValueError):
        raise ModelError(
            f"{name} returns {returned!r}; return a number for each instant."
        ) from None

    require(
        values.shape == times.shape,
        f"{name} returns {values.shape} values for {len(times)} instants; return one for each.",
    )
    if not np.isfinite(values).all():
        wrong = int(np.flatnonzero(~np.isfinite(values))[0])
        until = f" up to {end:.4g} s" if np.isfinite(end) else ""
        raise ModelError(
            f"{name} is {values[wrong]:g} at t = {times[wrong]:.4g} s; return finite "
            f"numbers{until}."
        )
    return values
