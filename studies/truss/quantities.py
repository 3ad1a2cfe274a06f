"""The quantities a deployment is judged by: one row for each, which all else asks.

Tables, keys of objectives and caps, the problem's constraints, histories and figures follow from
these rows. They stand in the order of the table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from studies.truss.carrier import RESIDUAL

if TYPE_CHECKING:  # CasADi loads with them, and not for a table of keys
    from ocp.arrays import Array
    from studies.truss.expressions import Instant
    from studies.truss.limits.bounds import LeastValues
    from studies.truss.limits.sizes import Sizes
    from studies.truss.motions.deployment import Deployment, Histories

Kind = Literal["peak", "least", "integral", "end", "duration"]
Needed = Literal["", "drum_radius", "torque_speed", "motor_inertia", "margin", "available", "arm"]


@dataclass(frozen=True)
class Cap:
    """What may limit a quantity.

    Attributes
    ----------
    key : of the cap in `Caps`; empty where there is none.
    limit : key of the drive's limit that is such a cap; empty where there is none.
    signal : whether the cap is a bound of a signal of the problem.
    sought : place among the caps whose least value is looked for where no motion is found, from 1;
        0 for none.
    back_off : part of the cap by which a solve stays below it: what its mesh misses.
    """

    key: str
    limit: str = ""
    signal: bool = False
    sought: int = 0
    back_off: float = 0.0


NO_CAP = Cap("")


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A number that a motion has.

    Attributes
    ----------
    called : its title with its unit, as "peak rope speed [m/s]".
    title, unit : how tables and figures call it, and its SI unit.
    kind : largest absolute value, least value, integral over time, value at the end, or duration.
    expression : of the problem's signals at an instant, what the kind is of; the largest of several
        counts.
    history : the same along a motion (m,), of an absolute value if it has both signs; None where
        the motion has no such number.
    value : of a motion, in place of a history; None where the motion has no such number.
    bound : what no motion of at most a duration beats; None for no bound.
    proof : of the bound by which a cap is refused, with {travel} [m] of one rope and the least
        {work} [J] in it; empty where no cap is refused by it.
    size : that a peak has at least, where it rests; None for that of the bound.
    forces : whether it depends on the dynamics.
    both_signs : whether its greatest modulus counts.
    needs : key of the drive, `[arm]`, `[margin]`, or with it what the motor has, without which
        there is no such number; empty for none.
    objective : whether it may be minimised.
    cap : what may limit it. But for a least value, it is the most that is allowed.
    """

    called: str = field(kw_only=False)
    title: str = field(init=False)
    unit: str = field(init=False)
    kind: Kind = "peak"
    expression: Callable[[Instant], tuple[Any, ...]] = lambda at: ()
    history: Callable[[Histories], Array | None] = lambda along: None
    value: Callable[[Deployment], float | None] = lambda motion: None
    bound: Callable[[LeastValues], float | None] = lambda least: None
    proof: str = ""
    size: Callable[[Sizes], float | None] = lambda sizes: None
    forces: bool = False
    both_signs: bool = False
    needs: Needed = ""
    objective: bool = True
    cap: Cap = NO_CAP

    def __post_init__(self) -> None:
        title, _, unit = self.called.removesuffix("]").partition(" [")
        object.__setattr__(self, "title", title)
        object.__setattr__(self, "unit", unit)

    @property
    def better(self) -> Literal["less", "more"]:
        """Whether less or more of it is better."""
        return "more" if self.kind == "least" else "less"

    def sized(self, sizes: Sizes) -> float:
        """Its size in a study, which minimises it."""
        known = self.size(sizes)
        found = self.bound(sizes) if known is None else known
        assert found is not None
        return found


QUANTITIES = {
    "time": Quantity(
        "duration [s]",
        kind="duration",
        value=lambda motion: float(motion.law.duration),
        bound=lambda least: least.time,
    ),
    "peak-speed": Quantity(
        "peak angular speed [rad/s]",
        history=lambda along: abs(along.law.speed),
        objective=False,
        cap=Cap("speed", signal=True),
        bound=lambda least: least.angle.speed,
    ),
    "peak-acceleration": Quantity(
        "peak angular acceleration [rad/s^2]",
        expression=lambda at: (at.acceleration,),
        history=lambda along: abs(along.law.acceleration),
        both_signs=True,
        cap=Cap("acceleration", signal=True),
        bound=lambda least: least.angle.acceleration,
    ),
    "peak-jerk": Quantity(
        "peak angular jerk [rad/s^3]",
        history=lambda along: abs(along.law.jerk),
        objective=False,
        cap=Cap("jerk", signal=True),
        bound=lambda least: least.jerk_of(least.angle),
    ),
    "peak-rope-speed": Quantity(
        "peak rope speed [m/s]",
        expression=lambda at: (at.rope_speed,),
        history=lambda along: abs(along.truss.rope_speed),
        cap=Cap("rope_speed", limit="speed", sought=11),
        bound=lambda least: least.rope.speed,
        proof="the mean is L/T, with {travel:.6g} m of rope",
    ),
    "peak-rope-acceleration": Quantity(
        "peak rope acceleration [m/s^2]",
        expression=lambda at: (at.rope_acceleration,),
        history=lambda along: abs(along.truss.rope_acceleration),
        both_signs=True,
        cap=Cap("rope_acceleration", limit="acceleration", sought=7),
        bound=lambda least: least.rope.acceleration,
        proof="4 L/T^2, or more under caps on its jerk and speed, with {travel:.6g} m of rope",
    ),
    "peak-rope-jerk": Quantity(
        "peak rope jerk [m/s^3]",
        expression=lambda at: (at.rope_jerk,),
        history=lambda along: abs(along.rope_jerk),
        both_signs=True,
        cap=Cap("rope_jerk", limit="jerk", sought=6),
        bound=lambda least: least.jerk_of(least.rope),
        proof="32 L/T^3, with {travel:.6g} m of rope",
    ),
    "peak-force": Quantity(
        "peak rope force [N]",
        expression=lambda at: at.rope_forces,
        history=lambda along: along.truss.rope_force,
        forces=True,
        cap=Cap("force", limit="force", sought=2),
        bound=lambda least: least.rope_force,
        size=lambda sizes: sizes.force_at_rest,
    ),
    "peak-far-end-tension": Quantity(
        "peak tension at the far end [N]",
        expression=lambda at: at.far_end_tensions,
        history=lambda along: along.truss.far_end_tension,
        forces=True,
        cap=Cap("far_end_tension", sought=14),
        size=lambda sizes: sizes.tension_at_rest,
    ),
    # tensions fall along the rope, so that the last segment has the least of all
    "least-tension": Quantity(
        "minimum tension of all segments [N]",
        kind="least",
        expression=lambda at: at.far_end_tensions,
        history=lambda along: along.least_tension,
        forces=True,
        objective=False,
        cap=Cap("least_tension"),
    ),
    "peak-bar-force": Quantity(
        "largest force in a bar [N]",
        expression=lambda at: at.bar_forces,
        history=lambda along: along.truss.bar_force,
        forces=True,
        both_signs=True,
        cap=Cap("bar_force", sought=13),
        # neighbours and net only add to what a rope does to the bars
        size=lambda sizes: sizes.force_at_rest,
    ),
    "peak-buckling-load": Quantity(
        "largest part of a buckling load [1]",
        expression=lambda at: at.buckling_loads,
        history=lambda along: along.truss.buckling_share,
        forces=True,
        objective=False,
        cap=Cap("buckling_load"),
    ),
    "peak-power": Quantity(
        "peak motor power [W]",
        expression=lambda at: (at.motor.power,),
        history=lambda along: along.motor.power,
        forces=True,
        cap=Cap("power", limit="power", sought=5),
        bound=lambda least: least.work / least.duration,
        proof="the mean is W/T, and the work W of the motors is at least {work:.6g} J",
    ),
    "energy": Quantity(
        "work of the motor [J]",
        kind="integral",
        expression=lambda at: (at.motor.power,),
        value=lambda motion: float(motion.energies.motor[-1]),
        forces=True,
        bound=lambda least: least.work,
    ),
    "peak-factored-force": Quantity(
        "motor force needed for the margins [N]",
        expression=lambda at: at.needed_of_the_motor,
        history=lambda along: along.needed_of_the_motor,
        forces=True,
        needs="margin",
        cap=Cap("factored_force", sought=12),
        bound=lambda least: least.need,
        proof="at rest, at the angle with the largest need, including all factors and margins",
    ),
    "peak-stall-force": Quantity(
        "stall force needed for the margins [N]",
        expression=lambda at: at.needed_at_standstill,
        history=lambda along: along.needed_at_standstill,
        forces=True,
        needs="available",
        cap=Cap("stall_force", sought=1),
        bound=lambda least: least.need,
        proof="at rest, at the angle with the largest need, including all factors and margins",
    ),
    "peak-motor-force": Quantity(
        "peak motor force, rotor included [N]",
        expression=lambda at: (at.motor.force, -at.motor.force),
        history=lambda along: abs(along.motor.force),
        forces=True,
        needs="motor_inertia",
        cap=Cap("motor_force", sought=3),
        bound=lambda least: least.motor_force,
        size=lambda sizes: sizes.force_at_rest,
    ),
    "peak-motor-speed": Quantity(
        "peak motor speed [rad/s]",
        expression=lambda at: (at.motor.shaft_speed,),
        history=lambda along: along.motor.shaft_speed,
        needs="drum_radius",
        objective=False,
        cap=Cap("motor_speed", limit="motor_speed"),
        bound=lambda least: least.motor_speed,
        proof="the mean of a shaft that winds in {travel:.6g} m of rope",
    ),
    "peak-motor-torque": Quantity(
        "peak motor torque [N m]",
        expression=lambda at: at.motor.torques,
        history=lambda along: along.largest(along.motor.torques),
        forces=True,
        needs="drum_radius",
        cap=Cap("motor_torque", limit="motor_torque", sought=4),
        bound=lambda least: least.motor_torque,
        size=lambda sizes: sizes.torque_at_rest,
    ),
    # its cap is the curve itself, the whole of which is 1
    "peak-motor-load": Quantity(
        "largest share of the torque-speed curve [1]",
        expression=lambda at: at.motor.loads,
        history=lambda along: along.largest(along.motor.loads),
        forces=True,
        needs="torque_speed",
        size=lambda sizes: sizes.load_at_rest,
    ),
    "peak-reaction": Quantity(
        "peak reaction on the arm [N]",
        expression=lambda at: (at.reaction,),
        history=lambda along: abs(along.truss.reaction_force),
        both_signs=True,
        cap=Cap("reaction", sought=8),
        bound=lambda least: least.reaction,
        proof="4 M R/T^2, with the mass M of the truss and the displacement R of its centre",
    ),
    "residual-energy": Quantity(
        "residual energy of the arm [J]",
        kind="end",
        expression=lambda at: (at.arm.left,),
        value=lambda motion: None if motion.arm is None else motion.arm.residual_energy,
        needs="arm",
        cap=Cap("residual_energy"),
        # as many motions leave nothing
        size=lambda sizes: RESIDUAL,
    ),
    "peak-root-moment": Quantity(
        "peak moment about the arm's root [N m]",
        expression=lambda at: (at.arm.moment,),
        history=lambda along: along.root_moment,
        forces=True,  # the ropes would have to push without
        both_signs=True,
        needs="arm",
        cap=Cap("wheel_torque", sought=9, back_off=2e-3),
        size=lambda sizes: sizes.root_moment,
    ),
    "peak-root-momentum": Quantity(
        "peak angular momentum at the arm's root [N m s]",
        expression=lambda at: (at.arm.momentum,),
        history=lambda along: along.root_momentum,
        forces=True,  # the ropes would have to push without
        both_signs=True,
        needs="arm",
        cap=Cap("wheel_momentum", sought=10, back_off=5e-4),
        size=lambda sizes: sizes.root_momentum,
    ),
}

OBJECTIVES = {key: quantity for key, quantity in QUANTITIES.items() if quantity.objective}
