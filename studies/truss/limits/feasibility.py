"""Caps that no motion meets, by proof: closed forms, the ridge, the ropes' pull, the phase plane.

Symbols: L [m] rope wound in; T [s] longest duration; W [J] least work of the motors.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from models.laws import RateCaps, greatest_start_speed, least_time
from models.truss import far_end_ratio, slider_distance, static_force
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.rounding import down, up
from studies.drive.motor import rope_force_of
from studies.margin.loads import least_static_need
from studies.truss.config import TrussStudy
from studies.truss.limits.bounds import (
    ROUNDING,
    keeps_the_caps,
    least_jerk,
    least_time_of_angle,
    least_time_of_the_mechanism,
    least_work,
    lower_bounds,
    path_of_angle,
    path_of_rope,
    rate_caps,
)
from studies.truss.limits.caps import cap_on
from studies.truss.limits.pull import (
    greatest_start_rate,
    least_time_of_pull,
    push_of_springs,
)
from studies.truss.limits.ridge import ridge_force
from studies.truss.quantities import QUANTITIES

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.motions.phase_plane import LeastForce


def check_feasible(
    study: TrussStudy,
    least_force: Callable[[], LeastForce],
    least_pull: Callable[[], LeastForce] | None = None,
) -> None:
    """Raise StudyError if a closed form or the phase plane shows that no motion meets the caps.

    Parameters
    ----------
    least_force, least_pull : callable
        Compute the phase-plane bounds, of the rope force and of the force of a motor with a rotor;
        called only if a cap on them makes them matter. Without the second one closed forms count.
    """
    _check_start(study)
    _check_jerk(study)
    _check_kinematics(study)
    _check_margins(study)
    _check_mechanism(study)
    _check_tension(study)
    cap = force_cap(study)
    if study.arm is not None:  # the proofs below are of a ring whose fixed bar is held
        if cap is not None:
            _check_end_forces(study, cap)
        _check_motor(study, None)
        return
    _check_pull(study)
    if cap is not None:
        _check_end_forces(study, cap)
        _check_ridge(study, cap)
        try:
            least = least_force()
        except StudyError:  # no bound to be had
            pass
        else:
            _check_force(study, cap, least)
        _check_pull_within(study, cap)
    _check_motor(study, least_pull)


@dataclass(frozen=True)
class Unattained:
    """A least value that no motion attains, although some come as near to it as one likes.

    Attributes
    ----------
    value : the limit, in the unit of what is minimised.
    sentence : what it is, and why it is not attained.
    remedy : what makes it attained, or keeps a study away from it.
    """

    value: float
    sentence: str
    remedy: str

    @property
    def refusal(self) -> StudyError:
        """What is raised where an optimum is asked for."""
        return _infeasible(f"no minimum exists: {self.sentence}; {self.remedy}")


def unattained(
    study: TrussStudy,
    least_force: Callable[[], LeastForce],
    least_pull: Callable[[], LeastForce] | None = None,
) -> Unattained | None:
    """The least value of a study's only objective where no motion attains it; None elsewhere.

    Parameters
    ----------
    least_force, least_pull : callable
        As of `check_feasible`; called only where the force is all that is minimised.
    """
    objective, *others = study.minimise[0]
    if others or study.arm is not None:  # these limits are of a ring whose fixed bar is held
        return None
    if objective == "time":
        return _unattained_time(study)
    if objective == "peak-rope-speed":
        return _unattained_speed(study)
    found = {"peak-force": least_force, "peak-motor-force": least_pull}.get(objective)
    return None if found is None else _unattained_force(study, found)


def _infeasible(sentence: str) -> StudyError:
    return StudyError(sentence, ExitCode.INFEASIBLE)


RATES = ("speed", "acceleration", "jerk")  # of the angle, that are capped


def _check_start(study: TrussStudy) -> None:
    """A rate at the start that is above a cap, or that passes the end before it can be braked."""
    caps, opening = study.caps, study.opening
    if not opening.rate:
        return
    rates = rate_caps(caps.speed, caps.acceleration, caps.jerk)
    under_the_caps = min(rates.speed, greatest_start_speed(opening.stroke, rates))
    allowed = min(under_the_caps, greatest_start_rate(study.truss, caps, opening))
    if opening.rate <= allowed * (1 + ROUNDING):
        return
    why = "ropes only pull, and springs, net and friction brake too little"
    remedy = f"give start_rate_deg_per_s at most {down(math.degrees(allowed))}"
    if opening.rate > under_the_caps:
        stated = [name for name in RATES if getattr(caps, name) is not None]
        why = f"the caps on {', '.join(stated)} leave it too little to brake"
        remedy += ", or raise a cap"
    raise _infeasible(
        f"no motion that starts at {math.degrees(opening.rate):g} deg/s comes to rest at "
        f"{math.degrees(opening.end):g} deg: {why}; {remedy}"
    )


def _check_jerk(study: TrussStudy) -> None:
    jerk, duration, path = study.caps.jerk, study.duration[1], path_of_angle(study)
    least = least_jerk(path, duration)
    if jerk is not None and jerk < least * (1 - ROUNDING):
        form = "" if path.start_speed else "32 D/T^3 = "
        raise _infeasible(
            f"no motion deploys in {duration:g} s with a jerk cap of {jerk:.6g} rad/s^3; raise the "
            f"cap to at least {form}{up(least)} rad/s^3, or lengthen the duration to at least "
            f"{up(least_time(path.way, RateCaps(jerk=jerk), path.start_speed))} s"
        )


def _check_kinematics(study: TrussStudy) -> None:
    caps, duration = study.caps, study.duration[1]
    least = least_time_of_angle(study)
    if least > duration * (1 + ROUNDING):
        # only the caps that are stated are named
        named = [
            f"{name} {value:g} {unit}"
            for name, value, unit in (
                ("speed", caps.speed, "rad/s"),
                ("acceleration", caps.acceleration, "rad/s^2"),
                ("jerk", caps.jerk, "rad/s^3"),
            )
            if value is not None
        ]
        raise _infeasible(
            f"no motion deploys in {duration:g} s under the caps on {', '.join(named)}; "
            f"they need at least {up(least)} s: lengthen the duration or raise a cap"
        )


def end_forces(study: TrussStudy) -> tuple[tuple[str, float, float], ...]:
    """Where the truss stands still, its static rope force [N] and the far end's share of it."""
    truss, opening = study.truss, study.opening
    places = (("start", opening.start), ("end", opening.end))
    return tuple(
        (where, float(static_force(truss, angle)), float(far_end_ratio(truss, angle)))
        for where, angle in (places[1:] if opening.rate else places)
    )


def _check_margins(study: TrussStudy) -> None:
    """Margins that no motion keeps: by what they need at rest, or by a bound on the force."""
    margin, cap = study.margin, study.caps.stall_force
    if margin is None or not margin.keep or cap is None:
        return
    need = lower_bounds(study, None)["peak-stall-force"]
    if cap >= need * (1 - ROUNDING):
        return
    at_rest = least_static_need(margin, study.truss, study.opening) >= need
    kind, asked = ("static", margin.required[0]) if at_rest else ("dynamic", margin.required[1])
    most = (1 + asked) * cap / need - 1
    ask = f"require at most {down(100 * most)} %, or " if most > 0.0 else ""
    raise _infeasible(
        f"no motion keeps a {kind} margin of {100 * asked:g} %: this margin needs a motor of "
        f"{up(need)} N for each rope, and the motor has {cap:.6g} N; {ask}use a stronger motor"
    )


def _check_mechanism(study: TrussStudy) -> None:
    """Caps below what any motion of the duration has."""
    duration = study.duration[1]
    bounds = lower_bounds(study, None)
    words = {"travel": path_of_rope(study).way, "work": least_work(study, duration)}
    proven = ((key, quantity) for key, quantity in QUANTITIES.items() if quantity.proof)
    for key, quantity in proven:
        cap, bound = cap_on(study.caps, study.drive, key), bounds.get(key)
        if cap is None or bound is None or cap >= bound * (1 - ROUNDING):
            continue
        raise _infeasible(
            f"no motion deploys in {duration:g} s with a {quantity.title} of at most {cap:.6g} "
            f"{quantity.unit}; its minimum is {up(bound)} {quantity.unit} "
            f"({quantity.proof.format(**words)}): raise the cap above it, or lengthen the duration"
        )

    together = least_time_of_the_mechanism(study)
    if together > duration * (1 + ROUNDING):
        raise _infeasible(
            f"no motion deploys in {duration:g} s under the caps on speed, acceleration and jerk "
            f"of rope and motor; they need at least {up(together)} s: lengthen the duration or "
            "raise a cap"
        )


# with one of them the rope needs a while to its speed, and a least peak of the speed is attained
_SLOWING = ("acceleration", "jerk", "rope_acceleration", "rope_jerk", "reaction", "force")


def _unattained_speed(study: TrussStudy) -> Unattained | None:
    """The least rope speed where nothing slows the rope: a jump to the mean speed and back."""
    if any(getattr(study.caps, name) is not None for name in _SLOWING):
        return None
    travel, winding = path_of_rope(study)
    mean = travel / study.duration[1]
    if winding >= mean:  # it slows down
        return None
    return Unattained(
        mean,
        f"the peak rope speed can approach its mean, {mean:.6g} m/s, but only a motion with jumps "
        "of the speed reaches it",
        "cap the rope's acceleration",
    )


def _unattained_time(study: TrussStudy) -> Unattained | None:
    """The least time where nothing slows the rope: one blow, then braking without a pull."""
    caps, low = study.caps, study.duration[0]
    slowed = any(getattr(caps, name) is not None for name in (*_SLOWING, "power"))
    if slowed or force_cap(study) is not None:
        return None
    least = least_time_of_pull(study.truss, caps, None, low, study.opening)
    if least <= low:
        return None
    return Unattained(
        least,
        f"the time can approach about {least:.4g} s, but only a motion with a jump of the speed "
        "reaches it",
        "cap the rope force, the acceleration or the jerk",
    )


def _unattained_force(
    study: TrussStudy, least_force: Callable[[], LeastForce]
) -> Unattained | None:
    """The least force where its motion would rest in an unstable equilibrium."""
    if study.jerk_limited:
        return None
    try:
        least = least_force()
    except StudyError:  # it gives no bound here, which is said beside the result
        return None
    # a cap that the motion near the limit keeps anyway changes nothing
    if least.attained or not keeps_the_caps(study, least.motion):
        return None
    return Unattained(
        least.force,
        least.sentence,
        f"cap the jerk, or choose a duration below {down(least.motion.duration, 3)} s",
    )


def force_cap(study: TrussStudy) -> float | None:
    """The most force on a rope [N] that caps on force and torque leave; None for no limit.

    A motor with a rotor limits its own force, and not that of the rope.
    """
    stated = [study.caps.force]
    if study.drive is None or study.drive.motor_inertia == 0.0:
        stated.append(motor_force_cap(study))
    return min((cap for cap in stated if cap is not None), default=None)


def motor_force_cap(study: TrussStudy) -> float | None:
    """The most force of a motor [N], its rotor included, that the caps leave; None for no limit."""
    caps, drive = study.caps, study.drive
    stated = [] if caps.motor_force is None else [caps.motor_force]
    if caps.motor_torque is not None and drive is not None:
        stated.append(rope_force_of(drive, caps.motor_torque))
    if drive is not None and drive.torque_speed is not None:
        stated.append(rope_force_of(drive, drive.torque_speed[0][1]))
    return min(stated, default=None)


def _check_motor(study: TrussStudy, least_pull: Callable[[], LeastForce] | None) -> None:
    """A force of a motor with a rotor below what any motion needs."""
    cap = motor_force_cap(study)
    if cap is None or study.drive is None or study.drive.motor_inertia == 0.0:
        return
    bounds = [lower_bounds(study, None)["peak-motor-force"]]
    with contextlib.suppress(StudyError):  # there may be none
        bounds += [least_pull().force] if least_pull is not None else []
    if cap < max(bounds) * (1 - ROUNDING):
        raise _infeasible(
            f"no motion deploys in {study.duration[1]:g} s with at most {cap:.6g} N of the motor "
            f"on each rope, its rotor included; every motion needs at least {up(max(bounds))} N: "
            "raise the cap on the motor's force or torque above it, or lengthen the duration"
        )


def _check_tension(study: TrussStudy) -> None:
    floor = study.caps.least_tension
    for where, force, share in end_forces(study):
        tension = force * share

        if study.jerk_limited and tension < 0.0:
            longest = float(slider_distance(study.truss, study.opening.start))
            raise _infeasible(
                f"no motion keeps every rope segment above {floor:g} N: at rest at the {where} the "
                "springs pull, and ropes cannot push; lengthen spring_free_length to "
                f"{up(longest)} m, or remove the jerk cap"
            )
        if study.jerk_limited and floor > tension * (1 + ROUNDING):
            raise _infeasible(
                f"no motion keeps every rope segment above {floor:g} N: at rest at the {where} the "
                f"tension of the last one is {down(tension)} N, from statics; lower least_tension "
                "to this value, or remove the jerk cap"
            )
        cap = force_cap(study)
        if cap is not None and floor / share > cap:
            raise _infeasible(
                f"a minimum tension of {floor:g} N needs a motor force of {up(floor / share)} N at "
                f"the {where}, above the force cap of {cap:g} N; lower least_tension to "
                f"{down(share * cap)} N, or raise the force cap to {up(floor / share)} N"
            )


def _check_pull(study: TrussStudy) -> None:
    """What ropes that only pull cannot do: hold the springs back, and brake in time."""
    truss, caps, duration = study.truss, study.caps, study.duration[1]
    if caps.acceleration is not None:
        push = push_of_springs(truss, caps, study.opening)
        if push.acceleration > caps.acceleration * (1 + ROUNDING):
            raise _infeasible(
                f"no motion meets the acceleration cap of {caps.acceleration:g} rad/s^2: at "
                f"{math.degrees(push.angle):.2f} deg the springs alone accelerate the truss by at "
                f"least {up(push.acceleration)} rad/s^2, and ropes cannot brake; raise the cap "
                "above it, or lengthen spring_free_length"
            )

    least = least_time_of_pull(truss, caps, None, duration, study.opening)
    if math.isinf(least):
        raise _infeasible(
            "no motion comes to rest at the end: ropes only pull, and nothing else brakes the "
            "truss at the angles where it must slow down; lengthen spring_free_length"
        )
    if least > duration:
        raise _infeasible(
            f"no motion deploys in {duration:g} s: ropes only pull, so only springs, net and "
            f"friction brake the truss, and this takes at least {up(least)} s under the caps on "
            f"its rates; lengthen the duration to at least {up(least)} s"
        )


def _check_pull_within(study: TrussStudy, cap: float) -> None:
    """The same with a cap on the force beside those on the rates."""
    least = least_time_of_pull(study.truss, study.caps, cap, study.duration[1], study.opening)
    if least <= study.duration[1]:
        return
    time = "" if math.isinf(least) else f"lengthen the duration to at least {up(least)} s, "
    raise _infeasible(
        f"no motion deploys in {study.duration[1]:g} s with at most {cap:g} N on each rope under "
        f"the caps on its rates; {time}raise the force cap, or relax another cap"
    )


def _check_end_forces(study: TrussStudy, cap: float) -> None:
    where, least, _ = max(end_forces(study), key=lambda end: end[1])
    if study.jerk_limited and cap < least * (1 - ROUNDING):
        raise _infeasible(
            f"no motion meets the force cap of {cap:g} N: to hold the truss at rest at the "
            f"{where}, each rope needs {up(least)} N; raise the cap above it, or remove the jerk "
            "cap"
        )


def _check_ridge(study: TrussStudy, cap: float) -> None:
    """A force cap below what inertia can save under the caps on the rates."""
    ridge = ridge_force(study.truss, study.caps, study.opening)
    if ridge is None or cap >= ridge.force * (1 - ROUNDING):
        return
    rates = [name for name in ("jerk", "acceleration") if getattr(study.caps, name) is not None]
    raise _infeasible(
        f"no motion meets the force cap of {cap:g} N: at {math.degrees(ridge.angle):.2f} deg every "
        f"motion under the {' and '.join(rates)} cap needs at least {up(ridge.force)} N on each "
        f"rope; raise the force cap above it, or raise the cap on the {' or '.join(rates)}"
    )


def _check_force(study: TrussStudy, cap: float, least: LeastForce) -> None:
    if cap >= least.force * (1 - ROUNDING) and (least.attained or cap > least.force):
        return
    limit = "" if least.attained else ", which no motion reaches"
    raise _infeasible(
        f"no motion deploys in {study.duration[1]:g} s with at most {cap:g} N on each rope; the "
        f"minimum force without other caps is {up(least.force)} N{limit} (phase plane, global); "
        "raise the force cap above it"
    )
