"""A drum of one layer or of several: its radius, and how far it turns for a length of rope.

A layer has w turns. On all but the last of them the rope lies at one radius. On the last one it
climbs evenly to the next layer, a rope diameter d further out. With w = 1 that is a spiral.

Symbols: s [m] rope on the drum; theta [rad] its turn; r [m] radius of the rope's centre line, r0
in the first layer; k = 0, 1, ... the layer.

    ds = r dtheta        r_k = r0 + k d        in a climb r = r_k + d theta_c / (2 pi)

so that r^2 grows by d / pi for each metre of a climb, and k full layers hold

    S_k = 2 pi (w r0 + (1 - w) d / 2) k + pi w d k^2
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array

TURN = 2 * math.pi


@dataclass(frozen=True)
class Drum:
    """A drum that is empty when the motion starts.

    Attributes
    ----------
    radius : r0 [m].
    growth : d [m]; 0 is one layer that never ends.
    turns : w, of one layer, at least 1.
    """

    radius: float
    growth: float = 0.0
    turns: float = 1.0

    def radius_at(self, rope: Any) -> Any:
        """Radius [m] with so much rope on the drum: a number, an array or an expression."""
        if not self.growth:
            return self.radius
        _, inner, _, climbing = self._place(rope)
        return (inner**2 + self.growth / math.pi * climbing) ** 0.5

    def turn_at(self, rope: Any) -> Any:
        """Turn [rad] with so much rope on the drum: a number, an array or an expression."""
        if not self.growth:
            return rope / self.radius
        layer, inner, level, climbing = self._place(rope)
        outer = (inner**2 + self.growth / math.pi * climbing) ** 0.5
        return TURN * self.turns * layer + level / inner + (outer - inner) * TURN / self.growth

    def acceleration_at(self, rope: Any, speed: Any, acceleration: Any) -> Any:
        """Acceleration of the drum [rad/s^2] from rope, speed and acceleration, of any kind."""
        radius = self.radius_at(rope)
        if not self.growth:
            return acceleration / radius
        _, _, _, climbing = self._place(rope)
        return (acceleration - (climbing > 0) * self.steepest * (speed / radius) ** 2) / radius

    def rope_at(self, turn: Array) -> Array:
        """Rope [m] on the drum after turns (m,) [rad]."""
        if not self.growth:
            return np.asarray(self.radius * turn)
        layer, level, climb = self._place_of(turn)
        inner = self.radius + layer * self.growth
        wound = inner * (level + climb) + self.growth * climb**2 / (2 * TURN)
        return np.asarray(self._held(layer) + wound)

    def turned(self, rope: Array) -> Array:
        """Turn, speed, acceleration and jerk of the drum (4, m), from those of the rope (4, m)."""
        radius, slope = self.radius_at(rope[0]), self._slope(self.turn_at(rope[0]))
        speed = rope[1] / radius
        acceleration = (rope[2] - slope * speed**2) / radius
        jerk = (rope[3] - 3 * slope * speed * acceleration) / radius
        return np.stack([self.turn_at(rope[0]), speed, acceleration, jerk])

    def wound(self, turned: Array) -> Array:
        """The rope's motion (4, m) from that of the drum (4, m)."""
        turn, speed, acceleration, jerk = turned
        rope, slope = self.rope_at(turn), self._slope(turn)
        radius = self.radius_at(rope)
        return np.stack(
            [
                rope,
                radius * speed,
                radius * acceleration + slope * speed**2,
                radius * jerk + 3 * slope * speed * acceleration,
            ]
        )

    def corners(self, most: float) -> list[float]:
        """Lengths of rope below `most` at which a climb begins or ends [m]."""
        found: list[float] = []
        layer = 0
        while self.growth and self._held(layer) < most:
            level = TURN * (self.turns - 1) * (self.radius + layer * self.growth)
            found += [self._held(layer), self._held(layer) + level]
            layer += 1
        return sorted({rope for rope in found if 0.0 < rope < most})

    @property
    def steepest(self) -> float:
        """Most that the radius grows by a turn of one radian [m/rad]."""
        return self.growth / TURN

    def _held(self, layer: Any) -> Any:
        """S_k [m]."""
        first = self.turns * self.radius + (1 - self.turns) * self.growth / 2
        return TURN * first * layer + math.pi * self.turns * self.growth * layer**2

    def _place(self, rope: Any) -> tuple[Any, Any, Any, Any]:
        """Layer, its radius r_k [m], and the rope in it before its climb and in it [m]."""
        of = np if isinstance(rope, float | int | np.ndarray) else ca
        wide = math.pi * self.turns * self.growth
        half = math.pi * (self.turns * self.radius + (1 - self.turns) * self.growth / 2)
        positive = of.fmax(rope, 0.0)  # what is paid out beyond the start leaves the first layer
        layer = of.floor((of.sqrt(half**2 + wide * positive) - half) / wide)

        inner = self.radius + layer * self.growth
        within = rope - self._held(layer)
        level = TURN * (self.turns - 1) * inner
        return layer, inner, of.fmin(within, level), of.fmax(within - level, 0.0)

    def _place_of(self, turn: Array) -> tuple[Array, Array, Array]:
        """Layer, and the turn in it before its climb and in it [rad]."""
        layer = np.floor(np.maximum(turn, 0.0) / (TURN * self.turns))
        within = turn - TURN * self.turns * layer
        level = TURN * (self.turns - 1)
        return layer, np.minimum(within, level), np.maximum(within - level, 0.0)

    def _slope(self, turn: Array) -> Any:
        """By how much the radius grows with the turn [m/rad]."""
        if not self.growth:
            return 0.0
        _, _, climb = self._place_of(turn)
        return np.where(climb > 0.0, self.steepest, 0.0)
