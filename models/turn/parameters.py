"""What turns in stage 2, and on which spring: the folded antenna on the big arm, which twists.

The paper names the stage and gives no parameter of it. The drive is taken to be at the root of the
big arm, so that the arm's torsion lies between drive and antenna. The small arm is folded along the
big one and the ring is stowed: a thin hoop whose centre is its own radius away from the axis. Small
arm and tube of the big arm have next to no inertia about the axis. Bending is left out.

Symbols: J2 [kg m^2] inertia of the antenna; k [N m/rad] stiffness; M [kg] mass; R [m] radius of the
ring; G [Pa] shear modulus; J [m^4] polar second moment; L [m] length; nu Poisson's ratio.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from models.arm.parameters import ArmParameters
from models.errors import require, require_positive
from models.truss.kinematics import ring_radius
from models.truss.parameters import TrussParameters

POISSON = 0.3  # of the big arm's tube, an assumption


def stowed_ring_inertia(truss: TrussParameters, mass: float) -> float:
    """Inertia J2 [kg m^2] = 2 M R(alpha0)^2: of a hoop about its own axis, and of its offset R.

    Parameters
    ----------
    mass : of the folded antenna [kg].

    Raises
    ------
    ModelError
        If the mass is not positive.
    """
    require_positive("stowed_ring_inertia", mass=mass)
    radius = float(ring_radius(truss, truss.stowed_angle))
    return 2.0 * mass * radius**2


def torsion_stiffness(arm: ArmParameters, poisson: float = POISSON) -> float:
    """Stiffness k [N m/rad] = G J / L of the big arm, a tube: J is twice its second moment of area.

    G = E / (2 (1 + nu)), so that G J = E I / (1 + nu).

    Raises
    ------
    ModelError
        If Poisson's ratio is not between -1 and 0.5.
    """
    require(
        -1.0 < poisson < 0.5,
        f"poisson is {poisson:g}; give a ratio between -1 and 0.5, such as 0.3.",
    )
    return arm.big.bending_stiffness / (1.0 + poisson) / arm.big.length


@dataclass(frozen=True)
class TurnParameters:
    """The antenna on its spring.

    Attributes
    ----------
    inertia : J2, of the antenna about the axis of the big arm [kg m^2].
    stiffness : k, of the big arm in torsion [N m/rad].

    Raises
    ------
    ModelError
        If one is not positive.
    """

    inertia: float
    stiffness: float

    def __post_init__(self) -> None:
        require_positive("TurnParameters", inertia=self.inertia, stiffness=self.stiffness)

    @property
    def frequency(self) -> float:
        """Of the antenna on the held drive, without damping [rad/s]."""
        return math.sqrt(self.stiffness / self.inertia)

    def on_free_satellite(self, satellite: float) -> TurnParameters:
        """The same on a satellite that is free to turn about the axis, as the satellite sees it.

        The drive acts between two bodies, so that their relative motion has the inertia
        J2 H / (J2 + H). Times its rate that is the momentum which either has, as nothing acts from
        outside.

        Parameters
        ----------
        satellite : float
            H, its inertia about the axis [kg m^2].

        Raises
        ------
        ModelError
            If it is not positive.
        """
        require_positive("TurnParameters", satellite=satellite)
        return replace(self, inertia=self.inertia * satellite / (self.inertia + satellite))
