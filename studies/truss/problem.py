"""The truss's optimal control problem, stated in `ocp`.

With a cap on jerk the states are angle, speed and acceleration, all zero rates at both ends (45),
and the jerk is the control. A motion that is under way at its start has its speed there, and any
acceleration. If the stretch of the ropes is planned the jerk is a state, zero at
both ends, and the snap is the control. Without a cap on jerk, zero acceleration at the ends means
nothing: the states are angle and speed. The control is the rope force where the optimum switches it
between its bounds, else the acceleration: in a slow motion the one is a small difference of large
others.

Where forces matter the motion has two phases, before and after the net becomes taut, so that the
kink of the potential (26) lies on their common end. One that passes no such angle has one.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import casadi as ca
import numpy as np

from models.ring_on_arm import ArmMotion, arm_motion
from models.truss import Net, TrussParameters, jerk_step_at_net, static_peak
from ocp import (
    Accuracy,
    AdaptiveMesh,
    Between,
    Bound,
    Constant,
    Control,
    Ipopt,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    joined,
    peak,
)
from studies.truss.arm_mesh import ArmMesh, period_to_follow
from studies.truss.carrier import RESIDUAL
from studies.truss.config import DEPLOYED, TrussStudy
from studies.truss.expressions import (
    ArmSignals,
    Instant,
    Pull,
    Reserve,
    Signals,
    acceleration_in,
    force_in,
)
from studies.truss.limits.caps import CAPPED, CURVE, cap_on
from studies.truss.limits.tolerances import OPTIMUM
from studies.truss.quantities import OBJECTIVES, QUANTITIES

if TYPE_CHECKING:  # which needs this module
    from studies.truss.motions.starts import StartingMotion

# The least root mean squares that a motion from rest to rest has: of the snap, with no acceleration
# and no jerk at its ends, times D/T^4 (a polynomial of degree 7 has it), of the jerk, with no
# acceleration there, times D/T^3 (the quintic law of (39) has it), and of the acceleration, times
# D/T^2 (the cubic law).
LEAST_SNAP = math.sqrt(100_800)
LEAST_JERK = math.sqrt(720)
LEAST_ACCELERATION = math.sqrt(12)
ROPE_FORCE = "rope force"  # name of its bounds

Drive = Literal["jerk", "acceleration", "force"]
Piecewise = Literal["constant", "linear", "polynomial"]

# whose caps are bounds of signals, not of formulas
SIGNAL_CAPS = {key for key, quantity in QUANTITIES.items() if quantity.cap.signal}

# With an arm: its modes of 18 and 68 Hz hardly swing, but all of a mesh would be spent on them.
# What the motion leaves in the arm is looked at by an integration of its own, which resolves them.
WITH_ARM = Accuracy(dynamics=1e-2, path=2e-4, objective=2e-4, replay=1e-1)
ROUGHLY_WITH_ARM = replace(WITH_ARM, objective=2e-3)  # to be compared with stages of a mission
# A moment at the root has parts from the faster modes, which an `ArmMesh` follows. A tighter
# objective would refine controls that hardly change it.
LEAST_MOMENT = replace(WITH_ARM, objective=8e-4)
# Its multipliers are large: with the default solver a least force took 200 iterations without end.
STIFF = Ipopt(
    tolerance=1e-6,
    dual_tolerance=1e-3,
    constraint_violation=1e-8,
    complementarity=1e-7,
    pivot_tolerance=1e-2,
)
# of degree 4 a least moment about the root took twice the intervals, and more than 60 s
ARM_DEGREE, ARM_INTERVALS = 6, 40
# Of the largest force at rest, by which the ropes stay taut on an arm: what its mesh misses.
PULL_MARGIN = 1e-3
# [J^(1/2)] by which a solve stays below the root of a cap on the energy: what its mesh misses.
ARM_MARGIN = 1.5e-4
LEAST_SHAPE = 1e-9  # [m, -]: the size of what hardly moves
# Where the stretch of the ropes is planned. The snap has no limit, so each finer mesh lowers a
# force that rides its peak a little more, with as large an estimated gain again. From so many
# unknowns on that is less than 1e-3 of the force, and no interval is cut for it: else no start ends
# before its budget.
ROUGHLY, ENOUGH_UNKNOWNS = 1e-4, 10_000
LEAST_OF_A_START = 60.0  # [s] that one start may take, if not more is its share
EARLIEST, LATEST = 1e-5, 1 - 1e-5  # of the duration, between which the net becomes taut


@dataclass(frozen=True, eq=False)
class Statement:
    """A stated problem and what is needed to read its solution.

    Attributes
    ----------
    phases : of the problem.
    nets : the branch of the potential in each phase.
    signals : as above.
    stages : the objectives to minimise, most important first, in units of their references.
    roughness : mean square of the jerk, or of an acceleration that may jump, relative to the least
        that a motion of the duration has; None where the rope force drives.
    price : of the roughness beside the first stage, in units of that stage; None without.
    """

    phases: tuple[Phase, ...]
    nets: tuple[Net, ...]
    signals: Signals
    stages: tuple[Any, ...]
    roughness: Any
    price: Constant | None
    links: tuple[Bound, ...]

    def problem(self, bounds: Sequence[Bound] = ()) -> Problem:
        """The problem that minimises the first stage, and the price of the roughness beside it.

        The law becomes smooth wherever the objective leaves it free.

        Parameters
        ----------
        bounds : sequence of Bound, optional
            Further ones, of unknown parameters of the truss.
        """
        objective = self.stages[0]
        if self.price is not None:
            objective = objective + self.price.symbol * self.roughness
        return Problem("truss", self.phases, minimise=objective, links=self.links, bounds=bounds)


def needs_forces(study: TrussStudy) -> bool:
    """Whether objective or caps depend on the rope force."""
    if study.plans_stretch or any(OBJECTIVES[name].forces for name in study.objectives):
        return True
    capped = [key for key in (*CAPPED, CURVE) if cap_on(study.caps, study.drive, key)]
    return any(QUANTITIES[key].forces for key in capped)


def state(
    study: TrussStudy,
    start: StartingMotion,
    references: Mapping[str, float],
    with_forces: bool,
    price: float = 0.0,
    reserve: Reserve | None = None,
    limits: Mapping[str, Constant] | None = None,
    truss: TrussParameters | None = None,
    pull: Pull | None = None,
) -> Statement:
    """State the study's problem with a start as guess.

    Parameters
    ----------
    references : mapping of objective to float
        Sizes by which weighted objectives are divided.
    with_forces : bool
        Whether the rope force is part of the problem: with two phases and T1 >= 0.
    price : float
        Of the roughness beside the first stage, in units of that stage.
    reserve : Reserve, optional
        With which limits of rope and motor hold, too.
    limits : mapping of quantity to Constant, optional
        Caps that are to be changed between solves, instead of the study's numbers; "time" is the
        longest duration.
    truss : TrussParameters, optional
        In place of the study's: a stand-in with unknowns for what the motion may leave to itself.
        The angles and what depends on them alone stay the study's.
    pull : Pull, optional
        Of several trusses that move by one law: objective and caps on forces hold for all.
    """
    caps, model = _Limits(study, limits or {}), study.ring_on_arm
    # the arm while the ring opens by the motion to start from
    moved = None if model is None else arm_motion(model, start.law)
    signals = _signals(study, study.truss if truss is None else truss, with_forces, caps, pull)
    if moved is not None:
        signals = replace(signals, arm=_arm_signals(moved, signals))
    nets = _nets(study) if with_forces else ("by angle",)
    phases = _phases(study, start, signals, nets, reserve, caps, moved)
    pairs = tuple(zip(phases, nets, strict=True))

    def weighted(name: str, weight: float) -> Any:
        return weight / references[name] * _objective(name, study, pairs, signals)

    stages = tuple(
        _sum(weighted(name, weight) for name, weight in stage.items()) for stage in study.minimise
    )

    roughness, priced = None, None
    if (rough := _rough(study, signals)) is not None:
        roughness = _sum(
            phase.integral(rough**2 / study.duration[1], "roughness") for phase in phases
        )
        priced = Constant("price of the roughness", value=price) if price > 0.0 else None

    links = tuple(joined(*phases, jump=_jump_at_net(signals))) if len(phases) == 2 else ()
    if signals.arm is not None and (most := caps.of("residual-energy")) is not None:
        left = phases[-1].at_end(signals.arm.left)
        root = ca.sqrt(most)
        aim = (root - ca.fmin(ARM_MARGIN, root / 2)) ** 2
        links += (Bound("energy left in the arm", left, "J", upper=aim, scale=RESIDUAL),)
    if "time" in caps.constants:  # free times lie between numbers
        longest = caps.constants["time"]
        links += (Bound("longest duration", phases[-1].end_time, "s", upper=longest),)
    return Statement(phases, nets, signals, stages, roughness, priced, links)


def _nets(study: TrussStudy) -> tuple[Net, ...]:
    """The branches of the potential that a motion passes."""
    if study.opening.start >= study.truss.net_angle:
        return ("taut",)
    return ("slack", "taut") if study.opening.end > study.truss.net_angle else ("slack",)


def _arm_signals(moved: ArmMotion, signals: Signals) -> ArmSignals:
    """The states of the arm, in sizes of the guess, and what they do."""
    model, swing = moved.model, 2 * math.pi * float(moved.model.frequencies(DEPLOYED)[0])
    q, v = [], []
    for name, values in zip(model.coordinates, moved.q, strict=True):
        unit = "m" if name.startswith("delta") else "1"
        size = max(float(np.abs(values).max()), LEAST_SHAPE)
        q.append(State(name, unit, scale=size))
        v.append(State(f"rate of {name}", f"{unit}/s", scale=size * swing))

    shape, rates = (ca.vertcat(*(one.symbol for one in group)) for group in (q, v))
    ring = (signals.angle.symbol, signals.speed.symbol, signals.acceleration.symbol)
    accelerations, torque = model.response(shape, rates, *ring)
    return ArmSignals(
        tuple(q),
        tuple(v),
        tuple(ca.vertsplit(accelerations)),
        torque,
        left=model.residual_energy(shape, rates),
        moment=model.root_moment(shape, rates, *ring),
        momentum=model.angular_momentum(shape, rates, *ring[:2]),
    )


def _jump_at_net(signals: Signals) -> Mapping[Any, Any] | None:
    """The jerk after the net became taut, if the motor winds in evenly; None if it may jump."""
    if signals.snap is None or signals.jerk is None:
        return None
    step = jerk_step_at_net(signals.truss, signals.speed.symbol)
    return {signals.jerk: signals.jerk.symbol + step}


def _rough(study: TrussStudy, signals: Signals) -> Any:
    """What is small in a smooth motion, as a multiple of the least that any motion has.

    Root mean squares count: of the jerk, or of the acceleration where that may jump.
    """
    stroke, duration = study.stroke, study.duration[1]
    if signals.snap is not None:
        return signals.snap.symbol / (LEAST_SNAP * stroke / duration**4)
    if signals.jerk is not None:
        return signals.jerk.symbol / (LEAST_JERK * stroke / duration**3)
    if signals.acceleration is not None:
        return signals.acceleration.symbol / (LEAST_ACCELERATION * stroke / duration**2)
    return None


def _sum(terms: Iterable[Any]) -> Any:
    """Sum of expressions."""
    return functools.reduce(operator.add, terms)


@dataclass(frozen=True, eq=False)
class _Limits:
    """The caps of a study as the problem states them: numbers, or constants in their place."""

    study: TrussStudy
    constants: Mapping[str, Constant]

    def of(self, quantity: str) -> Any:
        """The cap on a quantity; None where there is none, or a least tension of zero."""
        if quantity in self.constants:
            return self.constants[quantity].symbol
        return cap_on(self.study.caps, self.study.drive, quantity) or None

    def most(self, quantity: str) -> Any:
        """The same, infinite where there is none."""
        cap = self.of(quantity)
        return math.inf if cap is None else cap


def _signals(
    study: TrussStudy,
    truss: TrussParameters,
    with_forces: bool,
    caps: _Limits,
    pull: Pull | None = None,
) -> Signals:
    stowed = study.truss.stowed_angle
    drive, shape = control_of(study, with_forces)
    # which differs from truss to truss, and accelerates the arm as well
    if drive == "force" and (pull is not None or study.arm is not None):
        drive, shape = "acceleration", "polynomial"
    angle = State("angle", "rad", lower=stowed / 2, upper=2.0)
    speed = State("speed", "rad/s", lower=0.0, upper=caps.most("peak-speed"))
    most = caps.most("peak-acceleration")

    if drive == "jerk":
        acceleration = State("acceleration", "rad/s^2", lower=-most, upper=most)
        steepest = caps.most("peak-jerk")
        if study.plans_stretch:  # what is wound in has no step of its speed, nor has the jerk
            state = State("jerk", "rad/s^3", lower=-steepest, upper=steepest)
            snap = Control("snap", "rad/s^4", piecewise="constant")
            return Signals(truss, angle, speed, acceleration, state, None, pull, snap=snap)
        jerk = Control("jerk", "rad/s^3", lower=-steepest, upper=steepest, piecewise=shape)
        return Signals(truss, angle, speed, acceleration, jerk, None, pull)
    if drive == "force":
        force = Control(
            "rope force", "N", lower=0.0, upper=caps.most("peak-force"), piecewise=shape
        )
        return Signals(truss, angle, speed, None, None, force)
    control = Control("acceleration", "rad/s^2", lower=-most, upper=most, piecewise=shape)
    return Signals(truss, angle, speed, control, None, None, pull)


def control_of(study: TrussStudy, with_forces: bool) -> tuple[Drive, Piecewise]:
    """What drives the motion, and how it varies within an interval.

    Least acceleration, time and force make what they limit jump between its bounds: it is constant
    within an interval. An expression that rides its own peak or a cap needs a control that varies:
    the jerk linearly, an acceleration as smoothly as the states.
    """
    caps, objectives = study.caps, set(study.objectives)
    capped = {key for key in (*CAPPED, CURVE) if cap_on(caps, study.drive, key)}
    jumps = objectives <= {"peak-acceleration", "time"} and capped <= SIGNAL_CAPS
    if study.jerk_limited:
        return "jerk", "constant" if jumps else "linear"
    if not with_forces:
        return "acceleration", "constant" if jumps else "polynomial"

    # the force of the phase plane, which knows no other caps
    alone = capped <= {"peak-force", "least-tension"}
    if alone and objectives <= {"peak-force", "time"}:
        return "force", "constant"
    return "acceleration", "polynomial"


def settings_of(study: TrussStudy, with_forces: bool, accuracy: Accuracy | None = None) -> Settings:
    """How the engine solves: the stated intervals, shared out over the phases.

    A start that wanders leaves time for the others. The accuracy is that of a result by default.
    """
    share = study.solver.seconds / len(study.solver.starts)
    phases = len(_nets(study)) if with_forces else 1
    if (model := study.ring_on_arm) is not None:
        known, refinement = WITH_ARM, AdaptiveMesh(move_breakpoints=False)
        if "peak-root-moment" in study.objectives and accuracy is None:
            longest = period_to_follow(model)
            known, refinement = LEAST_MOMENT, ArmMesh(move_breakpoints=False, longest=longest)
        return Settings(
            scheme=Radau(ARM_DEGREE),
            intervals=-(-max(study.solver.intervals, ARM_INTERVALS) // phases),
            refinement=refinement,
            solver=STIFF,
            accuracy=accuracy or known,
            seconds=max(share, LEAST_OF_A_START),
        )
    # moved to the switches of the jerk; where forces matter, bisection is more robust
    moving = not with_forces and control_of(study, with_forces)[1] == "constant"
    # on its switches a motion is exact at once; elsewhere each digit more doubles the mesh
    usual = Accuracy() if moving else Accuracy(objective=OPTIMUM)
    refinement = AdaptiveMesh(move_breakpoints=moving)
    if study.plans_stretch:
        usual = Accuracy(objective=ROUGHLY)
        refinement = replace(refinement, most_unknowns=ENOUGH_UNKNOWNS)
    return Settings(
        intervals=max(2, -(-study.solver.intervals // phases)),
        refinement=refinement,
        accuracy=accuracy or usual,
        seconds=max(share, LEAST_OF_A_START),
    )


def _phases(
    study: TrussStudy,
    start: StartingMotion,
    signals: Signals,
    nets: tuple[Net, ...],
    reserve: Reserve | None,
    caps: _Limits,
    moved: ArmMotion | None,
) -> tuple[Phase, ...]:
    angle = signals.angle
    low, high = study.duration
    guess = min(max(start.duration, low), high)
    end: Any = high if low == high else Between(low, high, guess=guess)

    rest = {signals.speed: 0.0}
    if signals.jerk is not None:
        rest[signals.acceleration] = 0.0
    if isinstance(signals.jerk, State):
        rest[signals.jerk] = 0.0
    opening = study.opening
    first = {angle: opening.start, **rest}
    if opening.rate:  # nothing says what went before, so that its acceleration is free
        first = {angle: opening.start, signals.speed: opening.rate}
    if signals.arm is not None:
        first |= dict.fromkeys((*signals.arm.coordinates, *signals.arm.rates), 0.0)
    last = {angle: opening.end, **rest}
    if len(nets) == 1:
        bounds = _bounds(study, signals, nets[0], reserve, caps)
        return (
            _phase("deployment", moved, signals, nets[0], start, 0.0, end, first, last, bounds),
        )

    # two phases that meet where the net becomes taut
    earliest, latest = EARLIEST * low, LATEST * high
    net_time = min(max(start.net_time, earliest), latest)
    taut_from = Between(earliest, latest, guess=net_time)
    passing = {angle: study.truss.net_angle}
    slack, taut = (_bounds(study, signals, net, reserve, caps) for net in nets)
    return (
        _phase("net slack", moved, signals, "slack", start, 0.0, taut_from, first, passing, slack),
        _phase("net taut", moved, signals, "taut", start, taut_from, end, passing, last, taut),
    )


def _phase(
    name: str,
    moved: ArmMotion | None,
    signals: Signals,
    net: Net,
    start: StartingMotion,
    begin: Any,
    end: Any,
    initial: Mapping[State, float],
    final: Mapping[State, float],
    bounds: Sequence[Bound],
) -> Phase:
    acceleration = acceleration_in(signals, net)
    dynamics = {signals.angle: signals.speed, signals.speed: acceleration}
    guess: dict[Any, Any] = {signals.angle: start.angle, signals.speed: start.speed}

    if signals.jerk is not None:
        dynamics[signals.acceleration] = signals.jerk
        guess |= {signals.acceleration: start.acceleration, signals.jerk: start.jerk}
        if signals.snap is not None:
            dynamics[signals.jerk] = signals.snap
    elif signals.force is not None:
        guess[signals.force] = start.rope_force
    else:
        guess[signals.acceleration] = start.acceleration

    if (arm := signals.arm) is not None and moved is not None:
        dynamics |= dict(zip(arm.coordinates, arm.rates, strict=True))
        dynamics |= dict(zip(arm.rates, arm.accelerations, strict=True))
        rows = zip((*arm.coordinates, *arm.rates), (*moved.q, *moved.v), strict=True)
        guess |= {signal: (moved.time, values) for signal, values in rows}

    return Phase(
        name,
        dynamics=dynamics,
        initial=initial,
        final=final,
        start=begin,
        end=end,
        bounds=bounds,
        guess=guess,
    )


def _bounds(
    study: TrussStudy, signals: Signals, net: Net, reserve: Reserve | None, caps: _Limits
) -> list[Bound]:
    """Path constraints: the pull of the rope, and every cap that is no bound of a signal."""
    bounds = list(_caps_on_expressions(study, signals, net, reserve, caps))
    if net == "by angle":
        return bounds

    force, strongest = force_in(signals, net), caps.most("peak-force")
    if reserve is not None and caps.of("peak-force") is not None:
        (more,) = Instant(study, signals, net, reserve).rope_forces
        bounds.append(Bound("rope force with its reserve", more, "N", upper=strongest))
    if signals.force is None:
        size = static_peak(study.truss, study.opening).force
        least = 0.0 if signals.arm is None else PULL_MARGIN * size
        forces = (force,) if signals.pull is None else Instant(study, signals, net).rope_forces
        for name, one in zip(bound_names(ROPE_FORCE, len(forces)), forces, strict=True):
            bounds.append(Bound(name, one, "N", lower=least, upper=strongest, scale=size))
    elif caps.of("peak-acceleration") is not None:
        acceleration, most = acceleration_in(signals, net), caps.of("peak-acceleration")
        bounds.append(Bound("acceleration", acceleration, "rad/s^2", lower=-most, upper=most))
    return bounds


def _caps_on_expressions(
    study: TrussStudy, signals: Signals, net: Net, reserve: Reserve | None, caps: _Limits
) -> Iterator[Bound]:
    """Caps on what follows from the signals. Those on forces are for a problem that has them."""
    instant = Instant(study, signals, net, reserve)
    for key in (*CAPPED, CURVE):
        cap, quantity = caps.of(key), QUANTITIES[key]
        left_out = key in SIGNAL_CAPS or key in ("peak-force", "residual-energy")
        if cap is None or left_out or (quantity.forces and net == "by angle"):
            continue
        # what is a number, as the need at rest, is the same for all motions, and is no bound of one
        moving = quantity.expression(instant)
        if any(isinstance(one, float) for one in moving):
            moving = tuple(one for one in moving if not isinstance(one, float))
        for name, formula in zip(_names_of(quantity.title, moving), moving, strict=True):
            if quantity.kind == "least":
                # where a motion ends in an impulse its inertia's force is no measure of a tension
                size = static_peak(study.truss, study.opening).force
                yield Bound(name, formula, quantity.unit, lower=cap, scale=size)
            else:
                cap = cap * (1 - quantity.cap.back_off) if quantity.cap.back_off else cap
                lower = -cap if quantity.both_signs else -math.inf
                yield Bound(name, formula, quantity.unit, lower=lower, upper=cap)


def _names_of(title: str, formulas: tuple[Any, ...]) -> list[str]:
    """Names of bounds on the formulas of one quantity: in words where these are named."""
    fields: tuple[str, ...] = getattr(formulas, "_fields", ())
    if not fields:
        return bound_names(title, len(formulas))
    return [f"{title} ({field.replace('_', ' ')})" for field in fields]


def bound_names(title: str, count: int) -> list[str]:
    """Names of bounds on as many expressions of one quantity."""
    return [title] if count == 1 else [f"{title} ({number})" for number in range(1, count + 1)]


def _objective(
    name: str, study: TrussStudy, pairs: Sequence[tuple[Phase, Net]], signals: Signals
) -> Any:
    """An objective as a number of the motion."""
    quantity, (last, at_last) = OBJECTIVES[name], pairs[-1]

    def formulas(net: Net) -> tuple[Any, ...]:
        return quantity.expression(Instant(study, signals, net))

    match quantity.kind:
        case "duration":
            return last.end_time
        case "end":
            (left,) = formulas(at_last)
            return last.at_end(left)
        case "integral":
            return _sum(
                phase.integral(formula, "work", quantity.unit)
                for phase, net in pairs
                for formula in formulas(net)
            )
        case _:
            return peak(
                *((phase, formula) for phase, net in pairs for formula in formulas(net)),
                name=quantity.title,
                unit=quantity.unit,
                absolute=quantity.both_signs,
            )
