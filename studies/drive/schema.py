"""The drive as the user states it: `[drive]` in the TOML file of a study, or a file of its own."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.common.configuration import (
    boolean,
    check,
    choice,
    from_mapping,
    key,
    not_negative,
    optional_key,
    positive,
    read_toml,
    table,
    whole,
)
from studies.common.exit_codes import StudyError, quoted

if TYPE_CHECKING:  # CasADi loads with them
    from models.truss import RopeYields
    from studies.drive.drum import Drum

ROPE_YIELDS = ("at the motor", "along its length")
INTERPOLATIONS = ("hold", "linear", "hermite", "spline", "quintic")
FEWEST_COUNTS = 100.0  # over the travel: fewer resolve no motion worth optimising

Corners = tuple[tuple[float, float], ...]


def _efficiency(name: str, value: Any) -> float:
    """A number above zero and at most one."""
    share = positive(name, value)
    if share > 1.0:
        raise StudyError(f"{name} is {share:g}; give a fraction of at most 1, such as 0.8")
    return share


def _layer_turns(name: str, value: Any) -> float:
    """A number of at least one: within its last turn a layer climbs to the next."""
    turns = positive(name, value)
    if turns < 1.0:
        raise StudyError(f"{name} is {turns:g}; a layer has at least 1 turn, which is a spiral")
    return turns


def _corners(name: str, value: Any) -> Corners:
    """Corners of a falling torque-speed curve without dents."""
    pairs = isinstance(value, list | tuple) and len(value) >= 1
    if not pairs or not all(isinstance(one, list | tuple) and len(one) == 2 for one in value):
        raise StudyError(f"{name} is {quoted(value)}; give corners such as [[0, 0.5], [300, 0]]")
    corners = tuple(
        (not_negative(f"{name} (speed)", speed), not_negative(f"{name} (torque)", torque))
        for speed, torque in value
    )
    if corners[0][1] == 0.0 or corners[-1][0] == 0.0:
        raise StudyError(f"{name} is {quoted(value)}; its motor has no torque or no speed")
    slopes = [0.0]
    for (speed, torque), (faster, less) in pairwise(corners):
        if faster <= speed:
            raise StudyError(
                f"{name} has the speed {faster:g} after {speed:g}; give increasing speeds"
            )
        slopes.append((less - torque) / (faster - speed))
        if slopes[-1] > slopes[-2] + 1e-12 * abs(slopes[-2]):
            raise StudyError(
                f"{name} must be decreasing and concave, but is not at {speed:g} rad/s; remove the "
                "point at this speed"
            )
    return corners


@dataclass(frozen=True, kw_only=True)
class Drive:
    """A position-controlled drive that winds in a rope, or turns a joint.

    Attributes
    ----------
    drum_radius : at the rope's centre line in the first layer [m]; a joint has no drum.
    rope_diameter : by which the radius grows from layer to layer [m]; none is one layer alone.
    layer_turns : turns of rope in one layer, at least 1; on its last one the rope climbs.
    gear_ratio : turns of the motor for each turn of the drum or joint.
    efficiency : of gear and drum, the fraction of the motor's power that reaches the rope.
    counts : of the encoder a turn of the drum or joint; None is a position that is not rounded.
    period : between two set-points [s].
    interpolation : what the drive does between two points of its table.
    bandwidth, damping : of the position loop, taken as a low-pass of second order with the natural
        frequency 2 pi times the bandwidth [Hz]; without a bandwidth it follows exactly.
    buffer : the most points, or segments, that the device holds.
    longest_segment : the maximum time between two points of a table [s].
    speed, acceleration, jerk : limits of one rope [m/s, m/s^2, m/s^3], or of the joint in rad.
    force, power : limits of the pull on one rope [N] and of all motors together [W], at the rope.
    motor_speed, motor_torque : limits of one motor's shaft [rad/s, N m]; a rope has a motor.
    motor_inertia : of one motor's rotor about its shaft [kg m^2].
    torque_speed : corners (speed, torque) of what one motor can do [rad/s, N m], by rising speed.
    rope_stiffness : of one rope [N/m], the motor's pull per metre wound in while the truss stands;
        exports wind the stretch in beforehand.
    rope_yields : where it gives; along its length, the mean tension stretches it and not the pull.
    plan_stretch : whether an optimum of the truss winds that stretch in with it.
    rope_delay : by which the motor of one rope may be behind the other's, for what comes of it [s].
    tension_ramp : over which that tension is averaged, since no motor follows a step of it [s].
    start_dwell, end_dwell : rest before and after the motion [s].
    ropes : axes in one table, which all get the same motion.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    drum_radius: float | None = optional_key(
        positive, "m", "radius of the drum at the rope's centre line, in the first layer"
    )
    rope_diameter: float | None = optional_key(
        positive,
        "m",
        "diameter of the rope, by which the radius grows from layer to layer; none: one layer",
    )
    layer_turns: float | None = optional_key(
        _layer_turns, "", "turns of rope in one layer, at least 1; on the last turn the rope climbs"
    )
    gear_ratio: float = key(
        positive, "", "turns of the motor for each turn of the drum or joint", default=1.0
    )
    efficiency: float = key(
        _efficiency, "", "fraction of the motor's power that reaches the rope", default=1.0
    )
    counts: int | None = optional_key(
        whole(2),
        "",
        "encoder counts for each turn of the drum or joint; none: positions are not rounded",
    )
    period: float = key(positive, "s", "time between two set-points", default=0.01)
    interpolation: str = key(
        choice(INTERPOLATIONS),
        "",
        f"interpolation between two points of a table: {', '.join(INTERPOLATIONS)}",
        default="linear",
    )
    bandwidth: float | None = optional_key(
        positive, "Hz", "natural frequency of the position loop; none: the rope follows exactly"
    )
    damping: float = key(positive, "", "damping ratio of the position loop", default=0.7)
    buffer: int | None = optional_key(
        whole(2), "", "maximum number of points that the device stores"
    )
    longest_segment: float | None = optional_key(
        positive, "s", "maximum time between two points of a table"
    )
    speed: float | None = optional_key(positive, "m/s", "maximum speed of one rope")
    acceleration: float | None = optional_key(positive, "m/s^2", "maximum acceleration of one rope")
    jerk: float | None = optional_key(positive, "m/s^3", "maximum jerk of one rope")
    force: float | None = optional_key(positive, "N", "maximum pull on one rope")
    power: float | None = optional_key(positive, "W", "maximum power of all motors together")
    motor_speed: float | None = optional_key(positive, "rad/s", "maximum speed of one motor")
    motor_torque: float | None = optional_key(positive, "N m", "maximum torque of one motor")
    motor_inertia: float = key(
        not_negative,
        "kg m^2",
        "inertia of one motor's rotor about its shaft; needs the drum",
        default=0.0,
    )
    torque_speed: Corners | None = optional_key(
        _corners,
        "rad/s, N m",
        "corners [speed, torque] of the limits of one motor, by increasing speed",
    )
    rope_stiffness: float | None = optional_key(
        positive,
        "N/m",
        "of one rope: pull of the motor per metre wound in; exports also wind in the stretch",
    )
    rope_yields: RopeYields = key(
        choice(ROPE_YIELDS),
        "",
        f"where the rope stretches: {' or '.join(ROPE_YIELDS)}; along its length, its mean "
        "tension counts",
        default="at the motor",
    )
    plan_stretch: bool = key(
        boolean,
        "",
        "whether the optimum includes this stretch: the motor then starts and ends at rest",
        default=False,
    )
    rope_delay: float | None = optional_key(
        positive, "s", "delay of one rope's motor, whose effect is reported"
    )
    tension_ramp: float | None = optional_key(
        positive,
        "s",
        "time over which the tension for this stretch is averaged, twice; none: ten periods, or a "
        "twentieth of the motion if that is less",
    )
    start_dwell: float = key(not_negative, "s", "rest before the motion", default=0.0)
    end_dwell: float = key(not_negative, "s", "rest after the motion", default=0.0)
    ropes: int = key(whole(1, 2), "", "axes in one table, each with the same motion", default=1)

    def __post_init__(self) -> None:
        check(self, "drive.")
        if (self.rope_diameter is None) != (self.layer_turns is None):
            raise StudyError(
                "drive.rope_diameter and drive.layer_turns belong together: give both for a drum "
                "of several layers, or neither"
            )
        for name in ("plan_stretch", "rope_delay"):
            if getattr(self, name) and self.rope_stiffness is None:
                raise StudyError(
                    f"drive.{name} is given, but the ropes are rigid; also give "
                    "drive.rope_stiffness in N/m"
                )
        of_the_drum = ("motor_speed", "motor_torque", "motor_inertia", "torque_speed")
        for name in (*of_the_drum, "rope_diameter"):
            if getattr(self, name) and self.drum_radius is None:
                raise StudyError(
                    f"drive.{name} is given without a drum; add drum_radius in metres to the drive"
                )
        if self.rope_diameter is not None and self.rope_diameter > 2 * self.radius:
            raise StudyError(
                f"drive.rope_diameter is {self.rope_diameter:g} m, but drive.drum_radius "
                f"{self.radius:g} m is measured to the rope's centre line; give a radius of at "
                "least half the diameter"
            )

    def count(self, unit: str) -> float | None:
        """What one count is [m of rope, or rad of a joint]; None if positions are not rounded.

        Raises
        ------
        StudyError
            If it is rope and the drum has no radius, or more than one.
        """
        if self.counts is None:
            return None
        if unit == "rad":
            return 2 * math.pi / self.counts
        if self.rope_diameter is not None:
            raise StudyError(
                "drive.counts on a drum of several layers is no fixed length of rope; export the "
                "turn of the drum with --signal drum, or remove drive.counts"
            )
        return 2 * math.pi * self.radius / self.counts

    @property
    def radius(self) -> float:
        """Of the drum [m]; StudyError where it is not stated."""
        if self.drum_radius is None:
            raise StudyError(
                "drive.drum_radius is missing, but counts of rope depend on it; add drum_radius in "
                "metres to the drive"
            )
        return self.drum_radius

    @property
    def drum(self) -> Drum:
        """Of each rope; StudyError where its radius is not stated."""
        from studies.drive.drum import Drum

        if self.rope_diameter is None or self.layer_turns is None:
            return Drum(self.radius)
        return Drum(self.radius, self.rope_diameter, self.layer_turns)

    @property
    def natural_frequency(self) -> float | None:
        """Of the position loop [rad/s]."""
        return None if self.bandwidth is None else 2 * math.pi * self.bandwidth

    def check_travel(self, travel: float, unit: str) -> None:
        """Refuse an encoder too coarse for a travel, and say which would do.

        Raises
        ------
        StudyError
            If the travel has fewer than `FEWEST_COUNTS` counts.
        """
        count = self.count(unit)
        if count is None or travel >= FEWEST_COUNTS * count:
            return
        enough = math.ceil((self.counts or 1) * FEWEST_COUNTS * count / travel)
        raise StudyError(
            f"drive.counts is {self.counts}: the travel of {travel:.4g} {unit} has only "
            f"{travel / count:.1f} counts; give at least {enough} counts for each turn"
        )


def read_drive(path: Path) -> Drive:
    """The drive of a TOML file: its table `[drive]`, or the whole file where it has none.

    Raises
    ------
    StudyError
        If the file cannot be read, or naming the key, its value and the remedy.
    """
    raw = read_toml(path)
    return drive_from(table("drive", raw["drive"]) if "drive" in raw else raw)


def drive_of_file(text: str) -> Drive:
    """The drive of the file that a flag names; see `read_drive`."""
    return read_drive(Path(text))


def drive_from(raw: Mapping[str, Any]) -> Drive:
    """The drive that a mapping states; see `Drive`."""
    return from_mapping(Drive, raw, "drive.")
