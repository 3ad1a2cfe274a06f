"""The quantities a deployment is judged by: one row for each, which all else asks.

Tables, keys of objectives and caps, the problem's constraints, histories and figures follow from
these rows. They stand in the order of the table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
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


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A number that a motion has.

    Attributes
    ----------
    title : how tables and figures call it.
    unit : SI unit.
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
    cap : key of the cap on it in `Caps`; empty where there is none. But for a least value, the cap
        is the most that is allowed.
    limit : key of the drive's limit that is such a cap; empty where there is none.
    signal : whether the cap is a bound of a signal of the problem.
    sought : place among the caps whose least value is looked for where no motion is found, from 1;
        0 for none.
    back_off : part of the cap by which a solve stays below it: what its mesh misses.
    """

    title: str
    unit: str
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
    cap: str = ""
    limit: str = ""
    signal: bool = False
    sought: int = 0
    back_off: float = 0.0

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
        title="duration",
        unit="s",
        kind="duration",
        value=lambda motion: float(motion.law.duration),
        bound=lambda least: least.time,
    ),
    "peak-speed": Quantity(
        title="peak angular speed",
        unit="rad/s",
        history=lambda along: abs(along.law.speed),
        objective=False,
        cap="speed",
        signal=True,
        bound=lambda least: least.angle.speed,
    ),
    "peak-acceleration": Quantity(
        title="peak angular acceleration",
        unit="rad/s^2",
        expression=lambda at: (at.acceleration,),
        history=lambda along: abs(along.law.acceleration),
        both_signs=True,
        cap="acceleration",
        signal=True,
        bound=lambda least: least.angle.acceleration,
    ),
    "peak-jerk": Quantity(
        title="peak angular jerk",
        unit="rad/s^3",
        history=lambda along: abs(along.law.jerk),
        objective=False,
        cap="jerk",
        signal=True,
        bound=lambda least: least.jerk_of(least.angle),
    ),
    "peak-rope-speed": Quantity(
        title="peak rope speed",
        unit="m/s",
        expression=lambda at: (at.rope_speed,),
        history=lambda along: abs(along.truss.rope_speed),
        cap="rope_speed",
        limit="speed",
        sought=11,
        bound=lambda least: least.rope.speed,
        proof="the mean is L/T, with {travel:.6g} m of rope",
    ),
    "peak-rope-acceleration": Quantity(
        title="peak rope acceleration",
        unit="m/s^2",
        expression=lambda at: (at.rope_acceleration,),
        history=lambda along: abs(along.truss.rope_acceleration),
        both_signs=True,
        cap="rope_acceleration",
        limit="acceleration",
        sought=7,
        bound=lambda least: least.rope.acceleration,
        proof="4 L/T^2, or more under caps on its jerk and speed, with {travel:.6g} m of rope",
    ),
    "peak-rope-jerk": Quantity(
        title="peak rope jerk",
        unit="m/s^3",
        expression=lambda at: (at.rope_jerk,),
        history=lambda along: abs(along.rope_jerk),
        both_signs=True,
        cap="rope_jerk",
        limit="jerk",
        sought=6,
        bound=lambda least: least.jerk_of(least.rope),
        proof="32 L/T^3, with {travel:.6g} m of rope",
    ),
    "peak-force": Quantity(
        title="peak rope force",
        unit="N",
        expression=lambda at: at.rope_forces,
        history=lambda along: along.truss.rope_force,
        forces=True,
        cap="force",
        limit="force",
        sought=2,
        bound=lambda least: least.rope_force,
        size=lambda sizes: sizes.force_at_rest,
    ),
    "peak-far-end-tension": Quantity(
        title="peak tension at the far end",
        unit="N",
        expression=lambda at: at.far_end_tensions,
        history=lambda along: along.truss.far_end_tension,
        forces=True,
        cap="far_end_tension",
        sought=14,
        size=lambda sizes: sizes.tension_at_rest,
    ),
    # tensions fall along the rope, so that the last segment has the least of all
    "least-tension": Quantity(
        title="least tension of all segments",
        unit="N",
        kind="least",
        expression=lambda at: at.far_end_tensions,
        history=lambda along: along.least_tension,
        forces=True,
        objective=False,
        cap="least_tension",
    ),
    "peak-bar-force": Quantity(
        title="largest force in a bar",
        unit="N",
        expression=lambda at: at.bar_forces,
        history=lambda along: along.truss.bar_force,
        forces=True,
        both_signs=True,
        cap="bar_force",
        sought=13,
        # neighbours and net only add to what a rope does to the bars
        size=lambda sizes: sizes.force_at_rest,
    ),
    "peak-buckling-load": Quantity(
        title="largest part of a buckling load",
        unit="1",
        expression=lambda at: at.buckling_loads,
        history=lambda along: along.truss.buckling_share,
        forces=True,
        objective=False,
        cap="buckling_load",
    ),
    "peak-power": Quantity(
        title="peak motor power",
        unit="W",
        expression=lambda at: (at.motor_power,),
        history=lambda along: along.motor_power,
        forces=True,
        cap="power",
        limit="power",
        sought=5,
        bound=lambda least: least.work / least.duration,
        proof="the mean is W/T, and the motors do at least {work:.6g} J",
    ),
    "energy": Quantity(
        title="work of the motor",
        unit="J",
        kind="integral",
        expression=lambda at: (at.motor_power,),
        value=lambda motion: float(motion.energies.motor[-1]),
        forces=True,
        bound=lambda least: least.work,
    ),
    "peak-factored-force": Quantity(
        title="least motor force for the margins",
        unit="N",
        expression=lambda at: at.needed_of_the_motor,
        history=lambda along: along.needed_of_the_motor,
        forces=True,
        needs="margin",
        cap="factored_force",
        sought=12,
        bound=lambda least: least.need,
        proof="at rest, where it is largest, each factor and margin counted",
    ),
    "peak-stall-force": Quantity(
        title="stall force needed for the margins",
        unit="N",
        expression=lambda at: at.needed_at_standstill,
        history=lambda along: along.needed_at_standstill,
        forces=True,
        needs="available",
        cap="stall_force",
        sought=1,
        bound=lambda least: least.need,
        proof="at rest, where it is largest, each factor and margin counted",
    ),
    "peak-motor-force": Quantity(
        title="peak motor force, rotor included",
        unit="N",
        expression=lambda at: (at.motor_force, -at.motor_force),
        history=lambda along: along.motor_force,
        forces=True,
        needs="motor_inertia",
        cap="motor_force",
        sought=3,
        bound=lambda least: least.motor_force,
        size=lambda sizes: sizes.force_at_rest,
    ),
    "peak-motor-speed": Quantity(
        title="peak motor speed",
        unit="rad/s",
        expression=lambda at: (at.motor_speed,),
        history=lambda along: along.motor_speed,
        needs="drum_radius",
        objective=False,
        cap="motor_speed",
        limit="motor_speed",
        bound=lambda least: least.motor_speed,
        proof="the mean of a shaft that hauls in {travel:.6g} m of rope",
    ),
    "peak-motor-torque": Quantity(
        title="peak motor torque",
        unit="N m",
        expression=lambda at: at.motor_torques,
        history=lambda along: along.motor_torque,
        forces=True,
        needs="drum_radius",
        cap="motor_torque",
        limit="motor_torque",
        sought=4,
        bound=lambda least: least.motor_torque,
        size=lambda sizes: sizes.torque_at_rest,
    ),
    # its cap is the curve itself, the whole of which is 1
    "peak-motor-load": Quantity(
        title="largest share of the torque-speed curve",
        unit="1",
        expression=lambda at: at.motor_loads,
        history=lambda along: along.motor_load,
        forces=True,
        needs="torque_speed",
        size=lambda sizes: sizes.load_at_rest,
    ),
    "peak-reaction": Quantity(
        title="peak reaction on the arm",
        unit="N",
        expression=lambda at: (at.reaction,),
        history=lambda along: abs(along.truss.reaction_force),
        both_signs=True,
        cap="reaction",
        sought=8,
        bound=lambda least: least.reaction,
        proof="4 M R/T^2, with the truss's mass M and R, by which its centre moves",
    ),
    "residual-energy": Quantity(
        title="energy left in the arm",
        unit="J",
        kind="end",
        expression=lambda at: (at.arm.left,),
        value=lambda motion: None if motion.arm is None else motion.arm.residual_energy,
        needs="arm",
        cap="residual_energy",
        # as many motions leave nothing
        size=lambda sizes: RESIDUAL,
    ),
    "peak-root-moment": Quantity(
        title="peak moment about the arm's root",
        unit="N m",
        expression=lambda at: (at.arm.moment,),
        history=lambda along: along.root_moment,
        forces=True,  # the ropes would have to push without
        both_signs=True,
        needs="arm",
        cap="wheel_torque",
        sought=9,
        back_off=5e-4,
        size=lambda sizes: sizes.root_moment,
    ),
    "peak-root-momentum": Quantity(
        title="peak angular momentum at the arm's root",
        unit="N m s",
        expression=lambda at: (at.arm.momentum,),
        history=lambda along: along.root_momentum,
        forces=True,  # the ropes would have to push without
        both_signs=True,
        needs="arm",
        cap="wheel_momentum",
        sought=10,
        back_off=5e-4,
        size=lambda sizes: sizes.root_momentum,
    ),
}

OBJECTIVES = {key: quantity for key, quantity in QUANTITIES.items() if quantity.objective}
