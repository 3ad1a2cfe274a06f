"""Parameters of the supporting arm and of the pendulums of Table 1.

The paper (DOI 10.1109/ACCESS.2019.2918614) gives the lengths of the arm only; section and
material below are assumptions of this project, named one by one.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi

from models.ancf.chain import Chain, Link
from models.errors import require, require_not_negative, require_positive

ASSUMED_MODULUS = 70e9
"""Young's modulus of the CFRP tubes [Pa]: an assumption."""
ASSUMED_DENSITY = 1600.0
"""Density of the CFRP tubes [kg/m^3]: an assumption."""
ASSUMED_ANTENNA_MASS = 30.0
"""Mass of the folded antenna, a particle at the tip (the paper's idea) [kg]: an assumption."""


def tube(
    length: float,
    diameter: float,
    wall: float,
    modulus: float = ASSUMED_MODULUS,
    density: float = ASSUMED_DENSITY,
) -> Link:
    """Tube as a link, of the assumed CFRP by default.

    Parameters
    ----------
    length, diameter, wall : float
        Length, outer diameter and wall thickness [m].
    modulus : float
        Young's modulus [Pa].
    density : float
        [kg/m^3]

    Raises
    ------
    ModelError
        If a value is not positive, or the wall thicker than the radius.
    """
    require_positive("tube", diameter=diameter, wall=wall)
    inner = diameter - 2 * wall
    require(
        inner >= 0.0,
        f"tube: a wall of {wall:g} m does not fit a diameter of {diameter:g} m; give half the "
        "diameter or less.",
    )

    return Link.from_section(
        length,
        area=pi / 4 * (diameter**2 - inner**2),
        second_moment=pi / 64 * (diameter**4 - inner**4),
        modulus=modulus,
        density=density,
    )


BIG_ARM = tube(3.0, 0.060, 0.002)
"""Big arm: 3 m (paper), tube 60 x 2.0 mm (assumption)."""
SMALL_ARM = tube(2.0, 0.050, 0.0015)
"""Small arm: 2 m (paper), tube 50 x 1.5 mm (assumption)."""


@dataclass(frozen=True)
class ArmParameters:
    """The two-link supporting arm with the antenna as a particle.

    Parameters
    ----------
    big : Link
        From root to elbow.
    small : Link
        From elbow to tip.
    tip_mass : float
        The antenna, a particle at the tip [kg].
    elbow_mass : float
        Elbow drive, a particle [kg].
    hub_inertia : float
        Inertia that turns with the root [kg m^2].
    damping_ratio : float
        Internal damping over critical at `damping_frequency`; zero by default.
    damping_frequency : float
        Where the damping ratio holds [Hz].

    Raises
    ------
    ModelError
        If a value is negative.
    """

    big: Link = BIG_ARM
    small: Link = SMALL_ARM
    tip_mass: float = ASSUMED_ANTENNA_MASS
    elbow_mass: float = 0.0
    hub_inertia: float = 0.0
    damping_ratio: float = 0.0
    damping_frequency: float = 1.0

    def __post_init__(self) -> None:
        require_not_negative(
            "ArmParameters",
            tip_mass=self.tip_mass,
            elbow_mass=self.elbow_mass,
            hub_inertia=self.hub_inertia,
            damping_ratio=self.damping_ratio,
        )
        require_positive("ArmParameters", damping_frequency=self.damping_frequency)

    @property
    def relaxation_time(self) -> float:
        """Eta [s] of the internal damping."""
        return self.damping_ratio / (pi * self.damping_frequency)

    @property
    def elbow_inertia(self) -> float:
        """Rigid moment of inertia of the small arm and antenna about the elbow [kg m^2]."""
        tube_inertia = self.small.linear_density * self.small.length**3 / 3
        return tube_inertia + self.tip_mass * self.small.length**2

    def root_inertia(self, elbow_angle: float = 0.0) -> float:
        """Rigid moment of inertia about the root at an elbow angle [rad] [kg m^2]."""
        b, s = self.big, self.small

        # What hangs on the elbow, small arm and antenna: its mass, and its first moment about it.
        outer_mass = s.linear_density * s.length + self.tip_mass
        first_moment = s.linear_density * s.length**2 / 2 + self.tip_mass * s.length

        return (
            self.hub_inertia
            + b.linear_density * b.length**3 / 3
            + (outer_mass + self.elbow_mass) * b.length**2
            + 2 * b.length * cos(elbow_angle) * first_moment
            + self.elbow_inertia
        )

    def chain(self, elements: int = 8) -> Chain:
        """The full ANCF model with `elements` a link."""
        return Chain(
            links=(self.big, self.small),
            elements=elements,
            masses=(0.0, self.elbow_mass, self.tip_mass),
            hub_inertia=self.hub_inertia,
            damping_ratio=self.damping_ratio,
            damping_frequency=self.damping_frequency,
        )


GRAVITY = (0.0, -9.81)
"""Gravity of the paper's verification cases [m/s^2]."""
TABLE_1_SINGLE = Link.from_section(
    1.2, area=0.0018, second_moment=1.215e-8, modulus=2e9, density=5540.0
)
"""Link of the single pendulum, Table 1."""
TABLE_1_DOUBLE = Link.from_section(
    1.8, area=0.00025, second_moment=1.302e-9, modulus=6.895e10, density=2770.0
)
"""Either link of the double pendulum, Table 1 (3.6 m in all)."""


def single_pendulum(elements: int = 8) -> Chain:
    """Single pendulum of Table 1 under gravity."""
    return Chain((TABLE_1_SINGLE,), elements, gravity=GRAVITY)


def double_pendulum(elements: int = 8) -> Chain:
    """Double pendulum of Table 1 under gravity."""
    return Chain((TABLE_1_DOUBLE, TABLE_1_DOUBLE), elements, gravity=GRAVITY)
