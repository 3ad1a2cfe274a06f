"""Caps: limits that the user states, of the angle's motion, of the rope's and of what moves it.

The limits of a drive are caps as well. Where both are stated the lower one holds.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from studies.common.configuration import (
    Flag,
    as_number,
    check,
    describes,
    key,
    not_negative,
    optional_key,
    positive,
)
from studies.common.exit_codes import StudyError, quoted
from studies.drive.schema import Drive
from studies.margin.presets import PRESETS
from studies.margin.schema import MarginRequirements
from studies.truss.carrier import CarryingArm
from studies.truss.quantities import QUANTITIES

Study = TypeVar("Study", bound=Any)  # the studies that have caps know this module, not it them

JERK_LAWS = ("bezier", "step5")
MULTIPLE_OF_DURATION = re.compile(r"\s*([-+.\deE]+)\s*/\s*T\^3\s*")


@describes({"type": ["number", "string"]})
def jerk_cap(name: str, value: Any) -> float | str:
    """A number, or a text that the study turns into one, since it depends on the duration."""
    if not isinstance(value, str):
        return positive(name, value)
    multiple = MULTIPLE_OF_DURATION.fullmatch(value)
    if multiple is not None:
        positive(f"{name} times T^3", as_number(multiple[1]))
    elif value not in JERK_LAWS:
        raise StudyError(
            f"{name} is {quoted(value)}; give a number in rad/s^3, a multiple like 124.22/T^3, "
            "bezier or step5 for that law's own peak jerk, or none"
        )
    return value


@describes({"anyOf": [{"type": "number", "minimum": 0}, {"const": "none"}]})
def _tension(name: str, value: Any) -> float:
    """A number; "none" takes the limit away, down to the zero at which a rope goes slack."""
    return 0.0 if value == "none" else not_negative(name, value)


@dataclass(frozen=True, kw_only=True)
class Caps:
    """Limits that hold at all times; None is no limit.

    Attributes
    ----------
    speed, acceleration, jerk : of the deployment angle [rad/s], [rad/s^2], [rad/s^3].
    rope_speed, rope_acceleration, rope_jerk : of each rope [m/s], [m/s^2], [m/s^3].
    force : of the motor on each rope [N].
    power : of both motors together, at the ropes [W].
    motor_force : of the motor on each rope, its rotor included [N].
    motor_speed, motor_torque : of one motor's shaft [rad/s], [N m].
    reaction : on the supporting arm, of a ring on a tip that is held [N].
    residual_energy : left in the arm where the ring has opened [J]; 1e-6 if there is an arm.
    wheel_torque, wheel_momentum : that arm and ring hand to a held satellite [N m, N m s].
    least_tension : of every rope segment [N]; a rope only pulls, so at least 0.
    far_end_tension : of the rope's last segment, at its fixed end [N].
    bar_force : push or pull in any link or cross-bar [N].
    buckling_load : push in any bar, as part of its buckling load [1].
    link_reversal : of the largest push and pull of a link, the smaller [N]; checked, not sought.
    factored_force : of the motor on each rope, with the margins that are asked for [N].
    stall_force : the same of a motor at rest whose force falls with the speed [N]; margins that
        have to be kept state it.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    speed: float | None = optional_key(positive, "rad/s", "maximum speed of the deployment angle")
    acceleration: float | None = optional_key(
        positive, "rad/s^2", "maximum acceleration of the deployment angle"
    )
    jerk: float | None = optional_key(
        jerk_cap,
        "rad/s^3",
        'maximum jerk of the deployment angle; also "200/T^3", or "bezier" or "step5" for the '
        "peak of that law; without a cap the acceleration is free at the ends",
    )
    rope_speed: float | None = optional_key(positive, "m/s", "maximum speed of one rope")
    rope_acceleration: float | None = optional_key(
        positive, "m/s^2", "maximum acceleration of one rope"
    )
    rope_jerk: float | None = optional_key(
        positive,
        "m/s^3",
        "maximum jerk of one rope; with this cap the acceleration is zero at the ends",
    )
    force: float | None = optional_key(positive, "N", "maximum force of the motor on each rope")
    power: float | None = optional_key(positive, "W", "maximum power of both motors, at the ropes")
    motor_force: float | None = optional_key(
        positive, "N", "maximum force of the motor, including its rotor; needs drive.motor_inertia"
    )
    motor_speed: float | None = optional_key(
        positive, "rad/s", "maximum speed of one motor's shaft; needs drive.drum_radius"
    )
    motor_torque: float | None = optional_key(
        positive, "N m", "maximum torque of one motor's shaft; needs drive.drum_radius"
    )
    reaction: float | None = optional_key(positive, "N", "maximum reaction on the supporting arm")
    residual_energy: float | None = optional_key(
        positive,
        "J",
        "maximum residual energy of the arm and the open ring; 1e-6 if an arm is given and this "
        "energy is not an objective",
    )
    wheel_torque: float | None = optional_key(
        positive, "N m", "maximum moment about the arm's root on a held satellite; needs [arm]"
    )
    wheel_momentum: float | None = optional_key(
        positive, "N m s", "maximum angular momentum of its wheels; needs [arm]"
    )
    least_tension: float = key(
        _tension,
        "N",
        "minimum tension of every rope segment; a rope only pulls",
        default=0.0,
        flags=(Flag("--least-tension"),),
    )
    far_end_tension: float | None = optional_key(
        positive, "N", "maximum tension of the rope's last segment, at its fixed end"
    )
    bar_force: float | None = optional_key(
        positive, "N", "maximum push or pull in a link or cross-bar"
    )
    buckling_load: float | None = optional_key(
        positive,
        "",
        "maximum push in a bar as a fraction of its buckling load; needs truss.elastic_modulus",
        (Flag("--buckling-cap"),),
    )
    link_reversal: float | None = optional_key(
        positive,
        "N",
        "maximum reversal of a link: the smaller of its largest push and its largest pull, "
        "between which it crosses its play; the result is checked, but the solver does not use "
        "this cap",
        (Flag("--reversal-cap"),),
    )
    factored_force: float | None = optional_key(
        positive, "N", "maximum motor force that the margins need; needs [margin]"
    )
    stall_force: float | None = optional_key(
        positive,
        "N",
        "maximum stall force that the margins need; margin.keep sets it to the stall force of the "
        "motor",
    )

    def __post_init__(self) -> None:
        check(self, "caps.")


# quantity: the cap on it, in the order of the keys
CAPPED: Mapping[str, str] = {
    key: field.name
    for field in dataclasses.fields(Caps)
    for key, quantity in QUANTITIES.items()
    if quantity.cap.key == field.name
}
CURVE = "peak-motor-load"  # its cap is the curve itself, the whole of which is 1

# caps whose least value is looked for where no motion was found; the first that is stated. The
# torque-speed curve is none of them: without the curve there is no load to be least
HARD = sorted(
    (key for key in CAPPED if QUANTITIES[key].cap.sought),
    key=lambda key: QUANTITIES[key].cap.sought,
)


def within_the_drive(caps: Caps, drive: Drive | None) -> Caps:
    """The caps, lowered to the limits of the drive where these are lower."""
    lowered: dict[str, Any] = {}
    for cap in (one.cap for one in QUANTITIES.values() if one.cap.limit):
        of_the_drive = None if drive is None else getattr(drive, cap.limit)
        stated = (getattr(caps, cap.key), of_the_drive)
        lowered[cap.key] = min((one for one in stated if one is not None), default=None)
    return dataclasses.replace(caps, **lowered)


def with_margins_kept(caps: Caps, drive: Drive | None, margin: MarginRequirements | None) -> Caps:
    """The caps with the stall force of the motor, if its margins have to be kept."""
    if margin is None or not margin.keep:
        return caps
    from studies.margin.available import stall_force

    stated = (caps.stall_force, stall_force(margin, drive))
    return dataclasses.replace(caps, stall_force=min(f for f in stated if f is not None))


def check_stated(
    caps: Caps,
    objectives: Iterable[str],
    drive: Drive | None,
    margin: MarginRequirements | None,
    arm: CarryingArm | None,
) -> None:
    """Refuse what needs a drive, margins or an arm that are not stated.

    Raises
    ------
    StudyError
        Naming the key that is missing.
    """
    asked = {name: f"the objective {name}" for name in objectives}
    if margin is not None and margin.keep:
        asked["peak-stall-force"] = "margin.keep"
    asked |= {
        quantity: f"caps.{name}"
        for quantity, name in CAPPED.items()
        if getattr(caps, name) is not None
    }

    for quantity, words in asked.items():
        needed = QUANTITIES[quantity].needs
        if needed in ("margin", "available"):
            if margin is None:
                raise StudyError(
                    f"{words} needs the margins; give [margin] in the study, or --margin "
                    f"{next(iter(PRESETS))}"
                )
            if needed == "available" and not _has_a_motor(margin, drive):
                raise StudyError(
                    f"{words} needs the force of the motor; give margin.available, or force, "
                    "motor_torque or torque_speed of the drive"
                )
        elif needed == "arm":
            if arm is None:
                raise StudyError(
                    f"{words} needs the arm; give [arm] in the study, or --arm with the file of an "
                    "arm study"
                )
            name = CAPPED[quantity]
            if name.startswith("wheel") and words.startswith("caps") and arm.satellite_inertia:
                raise StudyError(
                    f"{words} is {getattr(caps, name):g}, but the satellite of "
                    f"{arm.satellite_inertia:g} kg m^2 is free to turn, so its wheels take "
                    "nothing; remove it or arm.satellite_inertia"
                )
        elif needed and (drive is None or not getattr(drive, needed)):
            raise StudyError(
                f"{words} needs the drive; add {needed} to [drive] of the study, or to the file "
                "of --drive"
            )


def _has_a_motor(margin: MarginRequirements, drive: Drive | None) -> bool:
    """Whether it is stated what the motor can pull."""
    from studies.margin.available import stall_force  # CasADi loads with it

    return stall_force(margin, drive) is not None


def cap_on(caps: Caps, drive: Drive | None, quantity: str) -> float | None:
    """The cap on a quantity; None where there is none."""
    if quantity == CURVE:
        return 1.0 if drive is not None and drive.torque_speed is not None else None
    name = CAPPED.get(quantity)
    return None if name is None else getattr(caps, name)


def without_cap(study: Study, quantity: str) -> Study:
    """A study without the cap on a quantity of `CAPPED`, whether stated or the drive's."""
    drive, cap, limit = study.drive, CAPPED[quantity], QUANTITIES[quantity].cap.limit
    if drive is not None and limit:
        drive = dataclasses.replace(drive, **{limit: None})
    margin = study.margin
    if cap == "stall_force" and margin is not None:
        margin = dataclasses.replace(margin, keep=False)
    caps = dataclasses.replace(study.caps, **{cap: None})
    return dataclasses.replace(study, caps=caps, drive=drive, margin=margin)
