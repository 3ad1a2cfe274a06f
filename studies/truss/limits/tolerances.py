"""Limits with their reasons: of what passes a verification, and of what is taken as meant.

Everything that a motion is held against has one of the limits below, and follows from what it is
for. The engine's own tolerances are in `ocp.verification.verify`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from studies.common.exit_codes import StudyError, quoted


@dataclass(frozen=True)
class Limit:
    """What passes a check.

    Attributes
    ----------
    value : the limit, in `unit`.
    unit : SI unit, or what it is a part of.
    reason : why it is that.
    """

    value: float
    unit: str
    reason: str


VERIFICATION: Mapping[str, Limit] = {
    "end angles of a motion that was found": Limit(
        1.6e-6,
        "rad",
        "1e-6 of the deployed angle, as the engine asks of its replay; the end of a bar of "
        "1 m is then 2 micrometres off, and a latch takes more",
    ),
    "end angles of a profile": Limit(
        1e-4, "rad", "0.006 deg, what a profile of four to five digits leaves"
    ),
    "speed and acceleration at the ends": Limit(
        1e-6, "of the peak", "as the engine asks; 1e-12 of the kinetic energy is left"
    ),
    "caps": Limit(
        1e-6,
        "of the cap",
        "ten times what the engine's path tolerance leaves a motion that rides its cap; no drive "
        "keeps a cap better",
    ),
    "least tension": Limit(
        1e-6,
        "of the peak rope force",
        "a tension is the force times a share, and is accurate to a share of the force",
    ),
    "duration": Limit(1e-9, "of the duration", "a bound of the solver, met to its rounding"),
    "balance of energy": Limit(
        1e-8,
        "of the motor's work",
        "the energies of a smooth law balance to 1e-14, and quadrature across steep pieces leaves "
        "more; an error of a formula leaves 1e-3",
    ),
    "speed below zero": Limit(
        1e-6, "of the peak speed", "a bound of the solver, met to its tolerance"
    ),
}

ANGLE_MISS = VERIFICATION["end angles of a motion that was found"].value
PROFILE_MISS = VERIFICATION["end angles of a profile"].value
REST = VERIFICATION["speed and acceleration at the ends"].value
CAPS = VERIFICATION["caps"].value
TENSION = VERIFICATION["least tension"].value
LONGER = VERIFICATION["duration"].value
IMBALANCE = VERIFICATION["balance of energy"].value
BACKWARD = VERIFICATION["speed below zero"].value

# Of the objective: what finer controls may still gain, so that the optimum is known to 1e-5.
# Where the force or a cap is ridden over a long arc, what the engine asks for by default takes five
# times as many intervals and up to thirty times the time.
OPTIMUM = 3e-6


@dataclass(frozen=True)
class Range:
    """What a number of the input may be.

    Attributes
    ----------
    low, high : in `unit`.
    unit : SI unit.
    reason : the physics that ends there.
    """

    low: float
    high: float
    unit: str
    reason: str


_LENGTH = Range(1e-3, 100.0, "m", "bars of below a millimetre or above 100 m are no space truss")

_FORCE_CAP = Range(
    0.0,
    1e7,
    "N",
    "a rope of 3 mm breaks at about 10 kN; leave the cap out where nothing limits the force",
)

PLAUSIBLE: Mapping[str, Range] = {
    "duration": Range(
        0.1,
        1e6,
        "s",
        "sound takes milliseconds through the ring, and links are rigid only for motions that "
        "take far longer; beyond eleven days inertia is below rounding",
    ),
    "caps.force": _FORCE_CAP,
    "drive.force": _FORCE_CAP,
    "caps.least_tension": Range(0.0, 1e4, "N", "a rope of 3 mm breaks at about 10 kN"),
    "solver.intervals": Range(2, 2000, "", "a mesh finds its own finer places from there"),
    "truss.modules": Range(3, 2000, "", "a ring of 2000 modules of 1 m is 640 m wide"),
    "truss.bar_length": _LENGTH,
    "truss.half_cross_bar": _LENGTH,
    "truss.crank": _LENGTH,
    "truss.link": _LENGTH,
    "truss.spring_free_length": _LENGTH,
    "truss.pulley_friction": Range(
        0.0,
        1.0,
        "",
        "no rope on a pulley has more than about 1 (dry rubber on stone), and the rope runs round "
        "the pulleys of all modules: little of the motor's force reaches the last one from 0.05 on",
    ),
    "truss.spring_stiffness": Range(0.0, 1e7, "N/m", "the bars themselves are no stiffer"),
    "truss.net_stiffness": Range(0.0, 1e7, "N/m", "the bars themselves are no stiffer"),
    "truss.joint_friction": Range(0.0, 1e6, "N m s/rad", "such a joint is a weld"),
    "truss.slider_friction": Range(0.0, 1e6, "N s/m", "such a slider is a weld"),
    "truss.joint_coulomb": Range(0.0, 1e5, "N m", "such a joint is a weld"),
    "truss.slider_coulomb": Range(0.0, 1e6, "N", "such a slider is a weld"),
    "truss.off_load_friction": Range(0.0, 1e6, "N", "such a rail is a clamp"),
    "truss.linear_density": Range(1e-6, 1e3, "kg/m", "a rail of steel has 60 kg/m"),
}


def check_plausible(key: str, value: float) -> None:
    """Refuse a number that is beyond the physics of the model.

    Raises
    ------
    StudyError
        With the limit and its reason.
    """
    allowed = PLAUSIBLE.get(key)
    if allowed is None or allowed.low <= value <= allowed.high:
        return
    below = value < allowed.low
    limit = allowed.low if below else allowed.high
    unit = f" {allowed.unit}" if allowed.unit else ""
    # a whole number may be beyond what a float holds
    shown = quoted(value) if isinstance(value, int) else f"{value:g}"
    raise StudyError(
        f"{key} is {shown}{unit}, {'below' if below else 'above'} the limit of "
        f"{limit:g}{unit}: {allowed.reason}"
    )
