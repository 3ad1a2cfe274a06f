"""Mechanics of the slider: functions of its position, of symbols as well as of arrays.

The position s counts from the start, where the spring is at rest. The pulley is at the distance D
along the rail and at the height h above it, so the rope has the length L = sqrt((D - s)² + h²). Its
force F pulls along the rail by F (D - s)/L and lifts by F h/L. Lifting takes load off the rail, and
with it friction. So a newton of the rope moves the slider by (D - s + mu h)/L newtons.
"""

from dataclasses import dataclass

import numpy as np

GRAVITY = 9.81  # [m/s²]


@dataclass(frozen=True, kw_only=True)
class Slider:
    """Its numbers.

    Attributes
    ----------
    mass : [kg].
    stiffness : of the spring [N/m].
    friction : coefficient of Coulomb friction, mu.
    distance, height : of the pulley, from the start along the rail and above it [m].
    """

    mass: float
    stiffness: float
    friction: float
    distance: float
    height: float

    def rope_length(self, s):
        """From the slider to the pulley [m]."""
        return ((self.distance - s) ** 2 + self.height**2) ** 0.5

    def rope_rate(self, s):
        """Change of the rope's length by the position."""
        return (s - self.distance) / self.rope_length(s)

    def leverage(self, s):
        """Newtons along the rail for one of the rope, with the friction that it takes away."""
        return (self.distance - s + self.friction * self.height) / self.rope_length(s)

    def resistance(self, s):
        """Of the spring, and of friction under the full weight [N]."""
        return self.stiffness * s + self.friction * self.mass * GRAVITY

    def load_on_rail(self, s, force):
        """Normal force [N]; the slider lifts off where it comes to zero."""
        return self.mass * GRAVITY - force * self.height / self.rope_length(s)

    def acceleration(self, s, force):
        """While it slides towards the pulley [m/s²]."""
        return (force * self.leverage(s) - self.resistance(s)) / self.mass

    def force(self, s, acceleration):
        """Of the rope, for an acceleration [N]."""
        return (self.mass * acceleration + self.resistance(s)) / self.leverage(s)

    def work_of_resistance(self, s):
        """From the start to a position [J]."""
        return self.stiffness * s**2 / 2 + self.friction * self.mass * GRAVITY * s

    def work_of_rope(self, s):
        """Of one newton, from the start to a position: the integral of the leverage [m]."""
        turn = np.arcsinh(self.distance / self.height) - np.arcsinh(
            (self.distance - s) / self.height
        )
        return self.rope_length(0.0) - self.rope_length(s) + self.friction * self.height * turn

    def stiffest_spring(self, travel):
        """That a rope stretches by a travel without lifting the slider off [N/m]."""
        return self.mass * GRAVITY * (2 * self.distance - travel) / (self.height * travel)
