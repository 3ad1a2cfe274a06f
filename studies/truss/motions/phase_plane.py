"""Least time under a force cap, and least force in a given time, from the phase plane.

With 0 <= T1 <= F and no other cap, no motion from its start is faster at any angle than the
one with T1 = F, and none that comes to rest at its end is faster than the one with T1 = 0. The two
cross once (their kinetic energies differ in slope by F f > 0), so the lower of the two gives the
least time, globally.

A rotor behind the drum acts as a mass on the rope. Then the motor pulls with F at most, and brakes
its rotor with F at most. T1 is less than F while the rotor speeds up. A motion comes to rest with
T1 = 0 or with -F at the motor, whichever brakes less. All else is as above.

Symbols: alpha [rad], omega [rad/s], t [s], T1 and F [N].
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from models.arrays import elementwise
from models.truss import (
    Net,
    Opening,
    TrussParameters,
    angular_acceleration,
    static_force,
    static_peak,
    whole_opening,
)
from ocp.arrays import Array
from studies.common.exit_codes import StudyError

TOLERANCE = 1e-12  # of the integration; its dense output is then good to about 1e-10
NEAR_LIMIT = 1e-8  # relative distance from the limit force below which forces are not resolved
_DECADES = 5  # beyond that distance, within which a motion has to get through
LIMIT_TOLERANCE = 1e-11  # relative, of the limit force
FOREVER = 1e6  # [s]
AT_REST = 1e-9  # [rad/s]; a motion as slow as this does not get through
MOST_EVALUATIONS = 30_000  # of a piece, explicitly; one that crawls takes more
MOST_OF_A_CRAWL = 1_000_000  # of a piece, with a method for stiff equations
TOLERANCE_OF_A_CRAWL = 1e-10  # rounding of the acceleration is not far below it
NETS: tuple[Net, ...] = ("slack", "taut")  # branches of the potential, on the way to open
POINTS = 400  # of a flow
BEYOND = 2.0  # [rad], an angle past the deployed one


class CrawlError(StudyError):
    """With little inertia, friction holds a motion at a crawl, too long to integrate."""

    def __init__(self) -> None:
        super().__init__(
            "The phase plane gives no bound on the force here: because of friction, motions near "
            "the bound are too slow to integrate."
        )


@dataclass(frozen=True, eq=False)
class FastestMotion:
    """The fastest motion under a force cap.

    Attributes
    ----------
    force : float
        The cap F [N].
    duration : float
        T_min(F) [s].
    switch_angle : float
        Where T1 drops from F to 0 [rad].
    time, angle, speed, rope_force : ndarray, shape (m,)
        The motion, dense [s], [rad], [rad/s], [N].
    peak_acceleration : float
        Of these points [rad/s^2].
    """

    force: float
    duration: float
    switch_angle: float
    time: Array
    angle: Array
    speed: Array
    rope_force: Array
    peak_acceleration: float

    @property
    def peak_speed(self) -> float:
        """Of these points [rad/s]."""
        return float(self.speed.max())


@dataclass(frozen=True, eq=False)
class LeastForce:
    """Least peak of the rope force in a given duration, with no other cap.

    Attributes
    ----------
    force : float
        F(T) [N]; if it is not attained, the limit it tends to.
    attained : bool
        Whether a motion attains `force`.
    motion : FastestMotion
        The motion at `force`, or at a force barely above the limit.
    """

    force: float
    attained: bool
    motion: FastestMotion

    @property
    def sentence(self) -> str:
        """What to say of this bound."""
        if self.attained:
            return f"minimum peak rope force without other caps: {self.force:.6g} N (phase plane)"
        return (
            f"the peak rope force can approach {self.force:.6g} N but not reach it: it would rest "
            f"in an unstable equilibrium at {math.degrees(_slowest_angle(self.motion)):.2f} deg"
        )


class PhasePlane:
    """The phase plane of one truss.

    Parameters
    ----------
    parameters : TrussParameters
    rotor : mass on each rope as which the rotor of its motor acts [kg].
    opening : of the motion; from stowed to open by default.
    """

    def __init__(
        self, parameters: TrussParameters, rotor: float = 0.0, opening: Opening | None = None
    ) -> None:
        self.parameters = parameters
        self.opening = opening or whole_opening(parameters)
        self._driven = _acceleration_functions(parameters, rotor)
        self._braked = _acceleration_functions(parameters, rotor, braking=True)
        self._rotor = rotor
        self._crawls = False  # a motion was found whose equations are stiff
        self._known_braking: dict[float, _Flow] = {}

    def _braking(self, force: float) -> _Flow:
        """To rest at the end, backwards, with at most `force` [N] at a motor that has a rotor."""
        key = force if self._rotor else 0.0
        if key not in self._known_braking:
            self._known_braking = {key: self._flow(key, self.opening.end, 0.0, sign=-1.0)}
        return self._known_braking[key]

    def fastest(self, force: float) -> FastestMotion | None:
        """Return the fastest motion with 0 <= T1 <= force [N], None if no motion gets through."""
        if force <= self._least_at_the_start:
            return None
        braking = self._braking(force)
        rate = self.opening.rate
        if rate and braking.excess(self.opening.start, rate) > 0.0:
            return None  # it would not come to rest at the end
        driven = self._driven_flow(force, below=braking)
        if driven.stalled:
            return None
        return self._join(force, driven, braking)

    def least_time(self, force: float) -> float:
        """T_min(force) [s]; infinite if no motion gets through."""
        motion = self.fastest(force)
        return math.inf if motion is None else motion.duration

    @cached_property
    def limit_force(self) -> float:
        """Largest force [N] with which no motion gets through, by bisection."""
        low = self._least_at_the_start
        high = static_peak(self.parameters, self.opening).force  # suffices even at a crawl

        # where friction outweighs inertia, nothing less gets through
        nearest = high * (1 - NEAR_LIMIT)
        if self._driven_flow(nearest).stalled:
            return high
        high = nearest
        while high - low > LIMIT_TOLERANCE * high:
            force = (low + high) / 2
            if self._driven_flow(force).stalled:
                low = force
            else:
                high = force
        return high

    @property
    def _least_at_the_start(self) -> float:
        """Force [N] below which no motion begins; one that is under way already needs none."""
        at_rest = float(static_force(self.parameters, self.opening.start))
        return 0.0 if self.opening.rate else at_rest

    def _driven_flow(self, force: float, below: _Flow | None = None) -> _Flow:
        """From the start on under a constant force."""
        return self._flow(force, self.opening.start, self.opening.rate, sign=1.0, below=below)

    def least_force(self, duration: float) -> LeastForce:
        """F that solves T_min(F) = duration [s], or the limit where T_min outlasts it."""
        limit = self.limit_force
        slowest = self._slowest(limit)
        if slowest.duration <= duration:
            return LeastForce(limit, False, slowest)

        high = 2 * limit
        while self.least_time(high) > duration:
            high *= 2

        # the time grows with the logarithm of the distance to the limit, so that is solved for

        def excess(logarithm: float) -> float:
            return self.least_time(limit + math.exp(logarithm)) - duration

        bracket = math.log(slowest.force - limit), math.log(high - limit)
        near = 1e-6 if self._crawls else 1e-10  # in a crawl the time is as good as that
        force = limit + math.exp(brentq(excess, *bracket, xtol=near, rtol=1e-14))
        motion = self.fastest(force)
        assert motion is not None
        return LeastForce(force, True, motion)

    def _slowest(self, limit: float) -> FastestMotion:
        """The motion barely above the limit.

        Where friction makes it a crawl, the integration stalls within its own error of the limit.

        Raises
        ------
        StudyError
            If no motion gets through at a force that is noticeably larger either.
        """
        for decade in range(_DECADES):
            motion = self.fastest(limit * (1 + NEAR_LIMIT * 10**decade))
            if motion is not None:
                return motion
        raise StudyError(
            f"the phase plane gives no bound on the force: its motions stall at {limit:.6g} N, "
            "although statics allow them to pass"
        )

    def _join(self, force: float, driven: _Flow, braking: _Flow) -> FastestMotion:
        """Motion along `driven`, then back along `braking`."""
        switch_angle = float(driven.pieces[-1].y[0, -1])
        brake_time = braking.time_at(switch_angle)
        duration = driven.duration + brake_time

        # the braking flow runs backwards in time, from rest at the end
        first, last = driven.upto(driven.duration), braking.upto(brake_time)[::-1]
        angle, speed = np.hstack([driven(first), braking(last)])
        rope_force = np.concatenate([np.full(first.size, force), np.zeros(last.size)])
        points = (angle, speed, np.full(angle.size, force))
        driving, slack = np.arange(angle.size) < first.size, angle < self.parameters.net_angle
        on_driving, on_braking = (
            np.where(slack, *(elementwise(of[net], *points)[0].ravel() for net in NETS))
            for of in (self._driven, self._braked)
        )
        acceleration = np.where(driving, on_driving, on_braking)
        return FastestMotion(
            force=force,
            duration=duration,
            switch_angle=switch_angle,
            time=np.concatenate([first, duration - last]),
            angle=angle,
            speed=speed,
            rope_force=rope_force,
            peak_acceleration=float(np.abs(acceleration).max()),
        )

    def _flow(
        self, force: float, angle: float, speed: float, sign: float, below: _Flow | None = None
    ) -> _Flow:
        """Integrate under constant `force`, forwards or (sign -1) backwards in time.

        Ends at rest (stall), where it meets the flow `below`, or at the end of the stroke; the
        flow `below` is at rest there, so a flow that is driven always meets it or stalls.
        """
        net_angle = self.parameters.net_angle
        goal = self.opening.end if sign > 0 else self.opening.start
        goal = goal if below is None else BEYOND

        pieces: list[Any] = []
        start, state, stalled = 0.0, (angle, speed), False
        for net, until in zip(NETS if sign > 0 else NETS[::-1], (net_angle, goal), strict=True):
            edge = sign * min(sign * until, sign * goal)
            if sign * edge <= sign * state[0]:  # it begins beyond
                continue
            piece = self._piece(force, net, state, start, sign, edge, below)
            pieces.append(piece)
            start, state = float(piece.t[-1]), tuple(piece.y[:, -1])
            stalled = piece.t_events[1].size > 0
            met = below is not None and piece.t_events[2].size > 0
            if stalled or met or edge == goal:
                break
        return _Flow(tuple(pieces), stalled)

    def _piece(
        self,
        force: float,
        net: Net,
        state: tuple[float, ...],
        start: float,
        sign: float,
        edge: float,
        below: _Flow | None,
    ) -> Any:
        """One branch of the potential: from a state to an edge, to rest, or to the flow below."""
        functions = self._driven if sign > 0 else self._braked
        acceleration = _Acceleration(functions[net], force)
        events = [_event(lambda y: y[0] - edge), _event(lambda y: y[1] - AT_REST, direction=-1)]
        if below is not None:
            events.append(_event(lambda y: below.excess(y[0], y[1]), direction=1))

        def integrated(method: str, tolerance: float, most: int) -> Any:
            evaluations = itertools.count(1)

            def rates(_: float, y: Array) -> tuple[float, float]:
                if next(evaluations) == most:
                    raise CrawlError
                return sign * y[1], sign * acceleration(y)

            return solve_ivp(
                rates,
                (start, FOREVER),
                state,
                method=method,
                dense_output=True,
                rtol=tolerance,
                atol=tolerance * 1e-2,
                events=events,
            )

        if not self._crawls:
            try:
                return integrated("DOP853", TOLERANCE, MOST_EVALUATIONS)
            except CrawlError:
                self._crawls = True
        return integrated("LSODA", TOLERANCE_OF_A_CRAWL, MOST_OF_A_CRAWL)


@dataclass(frozen=True)
class _Flow:
    """A curve of the phase plane: pieces of dense output over the time run so far."""

    pieces: tuple[Any, ...]
    stalled: bool

    @property
    def duration(self) -> float:
        return float(self.pieces[-1].t[-1])

    def __call__(self, time: Array) -> Array:
        """Angle and speed at `time`, shape (2, m)."""
        values = np.empty((2, time.size))
        for piece in reversed(self.pieces):
            inside = time <= piece.t[-1]
            if inside.any():
                values[:, inside] = piece.sol(time[inside])
        return values

    def time_at(self, angle: float) -> float:
        """Time at which the flow passes `angle`, that of its nearer end if it does not."""
        side = np.sign(self.pieces[-1].y[0, -1] - self.pieces[0].y[0, 0])
        if side * angle <= side * self.pieces[0].y[0, 0]:
            return 0.0
        for piece in self.pieces:
            if side * angle <= side * piece.y[0, -1]:
                return _invert(piece, angle)
        return self.duration

    def excess(self, angle: float, speed: float) -> float:
        """How far a speed is above that of the flow [rad/s]; far from it only about.

        A motion that turns behind the flow's end has passed it, too.
        """
        if speed <= 0.0 and angle > self._last_angle:
            return angle - self._last_angle
        angles, speeds, far = self._table
        roughly = speed - float(np.interp(angle, angles, speeds))
        if abs(roughly) > far:
            return roughly
        return speed - float(self(np.array([self.time_at(angle)]))[1, 0])

    @property
    def _last_angle(self) -> float:
        return float(max(self.pieces[0].y[0, 0], self.pieces[-1].y[0, -1]))

    @cached_property
    def _table(self) -> tuple[Array, Array, float]:
        """Angles, rising, their speeds, and what is far from these by any error between them."""
        angles, speeds = self(self.upto(self.duration))
        rising = slice(None, None, 1 if angles[-1] > angles[0] else -1)
        return angles[rising], speeds[rising], 0.05 * float(speeds.max())

    def upto(self, time: float) -> Array:
        """Times from 0 to `time`, those of the integrator's steps with some between."""
        steps = np.unique(np.concatenate([piece.t for piece in self.pieces]))
        steps = np.append(steps[steps < time], time)
        between = max(1, POINTS // max(1, steps.size - 1))
        fractions = np.arange(between) / between
        return np.append((steps[:-1, None] + np.diff(steps)[:, None] * fractions).ravel(), time)


def _invert(piece: Any, angle: float) -> float:
    """Time at which a piece of flow passes `angle`."""
    side = np.sign(piece.y[0, -1] - piece.y[0, 0])
    index = int(np.searchsorted(side * piece.y[0], side * angle))
    if index == 0 or piece.y[0, index] == angle:
        return float(piece.t[index])

    def beyond(time: float) -> float:
        return float(piece.sol(time)[0]) - angle

    return float(brentq(beyond, piece.t[index - 1], piece.t[index], xtol=1e-14, rtol=1e-14))


def _event(function: Callable[[Array], float], direction: float = 0.0) -> Any:
    def event(_: float, y: Array) -> float:
        return function(y)

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = direction  # type: ignore[attr-defined]
    return event


class _Acceleration:
    """Angular acceleration under a constant force, for an integrator that asks for it often.

    The function reads and writes the same three arrays each time, which takes a twentieth of a call
    with numbers.
    """

    def __init__(self, function: ca.Function, force: float) -> None:
        # CasADi holds addresses only: what they point to lives as long as this object
        self._state, self._force, self._result = np.zeros(2), np.array([force]), np.zeros(1)
        self._buffer, self._evaluate = function.buffer()
        for place, values in enumerate((self._state[:1], self._state[1:], self._force)):
            self._buffer.set_arg(place, values.data)
        self._buffer.set_res(0, self._result.data)

    def __call__(self, state: Array) -> float:
        """The acceleration [rad/s^2] at an angle [rad] and a speed [rad/s]."""
        self._state[:] = state
        self._evaluate()
        return float(self._result[0])


def _acceleration_functions(
    parameters: TrussParameters, rotor: float, braking: bool = False
) -> dict[Net, ca.Function]:
    """Accelerations under a force of the motor or, if it brakes, the least that it allows."""
    alpha, omega, tension = (ca.SX.sym(name) for name in ("alpha", "omega", "tension"))

    def acceleration(net: Net) -> ca.SX:
        if not braking:
            return angular_acceleration(parameters, alpha, omega, tension, net, rotor)
        without = angular_acceleration(parameters, alpha, omega, 0.0, net)
        if not rotor:
            return without
        held = angular_acceleration(parameters, alpha, omega, -tension, net, rotor)
        return ca.fmax(held, without)

    return {
        net: ca.Function(net, [alpha, omega, tension], [acceleration(net)], {"cse": True})
        for net in NETS
    }


def _slowest_angle(motion: FastestMotion) -> float:
    """Angle of the last local minimum of the speed [rad]."""
    inner = motion.speed[1:-1]
    dips = np.flatnonzero((inner <= motion.speed[:-2]) & (inner < motion.speed[2:]))
    return float(motion.angle[dips[-1] + 1]) if dips.size else float(motion.angle[-1])
