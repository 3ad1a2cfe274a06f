"""The arm as the user states it: `[arm]` in the files of all studies that have one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from models.arm.parameters import (
    ASSUMED_ANTENNA_MASS,
    ASSUMED_DENSITY,
    ASSUMED_MODULUS,
    ArmParameters,
    tube,
)
from models.errors import ModelError
from studies.common.configuration import check, key, not_negative, positive
from studies.common.exit_codes import StudyError
from studies.common.sizes import DENSITY, LENGTH, SECTION, limited


@dataclass(frozen=True, kw_only=True)
class ArmDescription:
    """The arm: two tubes, its masses, its damping.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    big_length: float = key(LENGTH, "m", "length of the big arm, from the paper", default=3.0)
    big_diameter: float = key(SECTION, "m", "outer diameter of its tube", default=0.060)
    big_wall: float = key(SECTION, "m", "thickness of its wall", default=0.002)
    small_length: float = key(LENGTH, "m", "length of the small arm, from the paper", default=2.0)
    small_diameter: float = key(SECTION, "m", "outer diameter of its tube", default=0.050)
    small_wall: float = key(SECTION, "m", "thickness of its wall", default=0.0015)
    modulus: float = key(positive, "Pa", "Young's modulus of both tubes", default=ASSUMED_MODULUS)
    density: float = key(DENSITY, "kg/m^3", "density of both tubes", default=ASSUMED_DENSITY)
    tip_mass: float = key(
        limited(not_negative),
        "kg",
        "mass of the antenna, a particle at the tip",
        default=ASSUMED_ANTENNA_MASS,
    )
    elbow_mass: float = key(
        limited(not_negative), "kg", "mass of the elbow's drive, a particle", default=0.0
    )
    hub_inertia: float = key(
        limited(not_negative),
        "kg m^2",
        "inertia that turns with the big arm, such as that of a drive",
        default=0.0,
    )
    damping_ratio: float = key(
        not_negative,
        "",
        "internal damping relative to critical damping at damping_frequency",
        default=0.0,
    )
    damping_frequency: float = key(
        positive, "Hz", "frequency at which damping_ratio holds", default=1.0
    )

    def __post_init__(self) -> None:
        check(self)
        assert self.parameters  # made once here, so that a tube that cannot be is said early

    @cached_property
    def parameters(self) -> ArmParameters:
        """Parameters of the models."""
        try:
            big, small = (
                tube(
                    getattr(self, f"{name}_length"),
                    getattr(self, f"{name}_diameter"),
                    getattr(self, f"{name}_wall"),
                    self.modulus,
                    self.density,
                )
                for name in ("big", "small")
            )
            return ArmParameters(
                big,
                small,
                tip_mass=self.tip_mass,
                elbow_mass=self.elbow_mass,
                hub_inertia=self.hub_inertia,
                damping_ratio=self.damping_ratio,
                damping_frequency=self.damping_frequency,
            )
        except ModelError as error:
            raise StudyError(str(error)) from error
