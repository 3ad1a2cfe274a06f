"""The quantities a deployment is judged by, and the objectives among them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal["peak", "least", "integral", "value"]
Needed = Literal["", "drum_radius", "torque_speed", "motor_inertia", "margin", "available", "arm"]


@dataclass(frozen=True)
class Quantity:
    """A number that a motion has.

    Attributes
    ----------
    title : how tables and figures call it.
    unit : SI unit.
    kind : largest absolute value, least value, integral over time, or a plain value.
    needs_forces : whether it depends on the dynamics.
    needs : key of the drive, `[arm]`, `[margin]`, or with it what the motor has, without which
        there is no such number; empty for none.
    """

    title: str
    unit: str
    kind: Kind
    needs_forces: bool
    needs: Needed = ""

    @property
    def better(self) -> Literal["less", "more"]:
        """Whether less or more of it is better."""
        return "more" if self.kind == "least" else "less"


OBJECTIVES = {
    "peak-acceleration": Quantity("peak angular acceleration", "rad/s^2", "peak", False),
    "peak-rope-acceleration": Quantity("peak rope acceleration", "m/s^2", "peak", False),
    "peak-force": Quantity("peak rope force", "N", "peak", True),
    "peak-reaction": Quantity("peak reaction on the arm", "N", "peak", False),
    "peak-power": Quantity("peak motor power", "W", "peak", True),
    "energy": Quantity("work of the motor", "J", "integral", True),
    "time": Quantity("duration", "s", "value", False),
    "peak-rope-speed": Quantity("peak rope speed", "m/s", "peak", False),
    "peak-rope-jerk": Quantity("peak rope jerk", "m/s^3", "peak", False),
    "peak-motor-force": Quantity(
        "peak motor force, rotor included", "N", "peak", True, "motor_inertia"
    ),
    "peak-motor-torque": Quantity("peak motor torque", "N m", "peak", True, "drum_radius"),
    "peak-motor-load": Quantity(
        "largest share of the torque-speed curve", "1", "peak", True, "torque_speed"
    ),
    "peak-factored-force": Quantity(
        "least motor force for the margins", "N", "peak", True, "margin"
    ),
    "peak-stall-force": Quantity(
        "stall force needed for the margins", "N", "peak", True, "available"
    ),
    "peak-bar-force": Quantity("largest force in a bar", "N", "peak", True),
    "peak-far-end-tension": Quantity("peak tension at the far end", "N", "peak", True),
    "residual-energy": Quantity("energy left in the arm", "J", "value", False, "arm"),
    "peak-root-moment": Quantity("peak moment about the arm's root", "N m", "peak", False, "arm"),
    "peak-root-momentum": Quantity(
        "peak angular momentum at the arm's root", "N m s", "peak", False, "arm"
    ),
}

QUANTITIES = {
    **OBJECTIVES,
    "peak-speed": Quantity("peak angular speed", "rad/s", "peak", False),
    "peak-jerk": Quantity("peak angular jerk", "rad/s^3", "peak", False),
    "peak-motor-speed": Quantity("peak motor speed", "rad/s", "peak", False, "drum_radius"),
    "peak-buckling-load": Quantity("largest part of a buckling load", "1", "peak", True),
    "least-tension": Quantity("least tension of all segments", "N", "least", True),
}
