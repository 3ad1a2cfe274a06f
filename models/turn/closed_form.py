"""The turn from rest to rest of least peak torque, under a cap on the drive's acceleration.

With the twist e = beta - psi and u = betaddot, |u| <= A:

    eddot + w^2 e = u,    w^2 = k / J2,    psiddot = w^2 e

The turn is the integral of w^2 e (T/2 - t). So among all twists |e| <= E that one turns farthest
which is as large as can be before T/2 and as small as can be after it. It rises from rest to E by
u = A and then -A, stays there by u = w^2 E, falls through zero at T/2 to -E by -A and then A, stays
there, and comes to rest as it began, in the other sense. Each arc is one of a circle about u / w^2.

The drive turns as far as the antenna, and its u is constant on each arc: that gives the turn in
closed form. It needs E <= A / w^2, or u could not keep the twist, and a time in which all arcs fit.

Symbols: T [s] duration; D [rad] turn; A [rad/s^2]; E [rad]; r = A / w^2 [rad].
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

from models.errors import require_positive
from models.turn.parameters import TurnParameters

_CLOSE = 1e-12  # relative, of a root


@dataclass(frozen=True)
class BangTurn:
    """A turn whose drive has a constant acceleration between its switches.

    Attributes
    ----------
    switches : times from 0 to the duration [s], one more than there are arcs.
    accelerations : of the drive on each arc [rad/s^2].
    peak_torque : [N m]
    """

    switches: tuple[float, ...]
    accelerations: tuple[float, ...]
    peak_torque: float

    @property
    def duration(self) -> float:
        """T [s]."""
        return self.switches[-1]

    @property
    def peak_speed(self) -> float:
        """Of the drive [rad/s]: its speed turns where its acceleration changes sign."""
        speed, highest = 0.0, 0.0
        for (begin, end), u in zip(pairwise(self.switches), self.accelerations, strict=True):
            speed += u * (end - begin)
            highest = max(highest, abs(speed))
        return highest


def least_torque_bound(turn: TurnParameters, angle: float, duration: float) -> float:
    """4 J2 D / T^2 [N m]: no turn has a lower peak torque, however its drive moves."""
    return 4.0 * turn.inertia * angle / duration**2


def least_turn_time_bound(
    turn: TurnParameters, angle: float, torque: float, acceleration: float
) -> float:
    """No turn under a cap on the torque and one on the drive's acceleration takes less [s].

    Antenna and drive both turn by D from rest to rest, each under a cap on its acceleration.
    """
    return 2.0 * math.sqrt(angle / min(torque / turn.inertia, acceleration))


def least_torque_turn(
    turn: TurnParameters, angle: float, duration: float, acceleration: float
) -> BangTurn | None:
    """The turn of least peak torque in a duration, or None if the closed form does not hold.

    Parameters
    ----------
    angle : D [rad], positive.
    duration : T [s].
    acceleration : A, the most of the drive [rad/s^2].

    Raises
    ------
    ModelError
        If an argument is not positive.
    """
    require_positive("turn", angle=angle, duration=duration, acceleration=acceleration)
    low, high = 0.0, acceleration / turn.frequency**2
    # the largest twist whose arcs fit into the time
    if _half_arcs(turn, high, acceleration) > duration / 2:
        low, high = (
            0.0,
            _bisected(lambda e: _half_arcs(turn, e, acceleration) - duration / 2, low, high)[0],
        )
    if _turned(turn, high, duration, acceleration) < angle:
        return None
    twist = _bisected(lambda e: _turned(turn, e, duration, acceleration) - angle, low, high)[1]
    return _arcs(turn, twist, duration, acceleration)


def torque_limited_turn(
    turn: TurnParameters, angle: float, torque: float, acceleration: float
) -> BangTurn | None:
    """The shortest turn whose torque is at most `torque` [N m], or None as `least_torque_turn`.

    Raises
    ------
    ModelError
        If an argument is not positive.
    """
    require_positive("turn", angle=angle, torque=torque, acceleration=acceleration)
    twist = torque / turn.stiffness
    if twist > acceleration / turn.frequency**2:
        return None
    low = 2.0 * _half_arcs(turn, twist, acceleration)
    if _turned(turn, twist, low, acceleration) > angle:
        return None
    high = low + 4.0 * least_turn_time_bound(turn, angle, torque, acceleration)
    duration = _bisected(lambda t: _turned(turn, twist, t, acceleration) - angle, low, high)[1]
    return _arcs(turn, twist, duration, acceleration)


def _rise_and_fall(
    turn: TurnParameters, twist: float, acceleration: float
) -> tuple[float, float, float]:
    """Times to rise by u = A and then -A from rest to E, and to fall from E to zero by -A [s]."""
    w, r = turn.frequency, acceleration / turn.frequency**2
    outer = twist + r
    # where the circle about r through rest meets that about -r through E
    up = math.acos((5.0 * r**2 - outer**2) / (4.0 * r**2))
    braked = math.asin(r * math.sin(up) / outer)
    return up / w, braked / w, math.acos(r / outer) / w


def _half_arcs(turn: TurnParameters, twist: float, acceleration: float) -> float:
    """Time of the arcs before T/2 on which the twist changes [s]."""
    return sum(_rise_and_fall(turn, twist, acceleration))


def _arcs(turn: TurnParameters, twist: float, duration: float, acceleration: float) -> BangTurn:
    up, braked, fall = _rise_and_fall(turn, twist, acceleration)
    middle, kept = duration / 2, turn.frequency**2 * twist
    before = (0.0, up, up + braked, middle - fall)
    switches = (*before, middle, *(duration - time for time in reversed(before)))
    first = (acceleration, -acceleration, kept, -acceleration)
    return BangTurn(switches, (*first, *(-u for u in reversed(first))), turn.stiffness * twist)


def _turned(turn: TurnParameters, twist: float, duration: float, acceleration: float) -> float:
    """What drive and antenna turn by [rad]: twice the integral of u (T/2 - t) up to T/2."""
    arcs, middle = _arcs(turn, twist, duration, acceleration), duration / 2
    half = zip(pairwise(arcs.switches[:5]), arcs.accelerations[:4], strict=True)
    return sum(u * ((middle - begin) ** 2 - (middle - end) ** 2) for (begin, end), u in half)


def _bisected(function: Callable[[float], float], low: float, high: float) -> tuple[float, float]:
    """A bracket of the root of a function that rises from below zero, as narrow as rounding."""
    while high - low > _CLOSE * high:
        middle = (low + high) / 2
        low, high = (middle, high) if function(middle) < 0.0 else (low, middle)
    return low, high
