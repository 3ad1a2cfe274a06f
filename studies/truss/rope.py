"""What ropes that give add to a result: stability, their mode, the swing that a law leaves."""

from __future__ import annotations

import math

import numpy as np

from models.errors import ModelError
from models.truss import (
    LeastStiffness,
    RopeSwing,
    TrussParameters,
    WoundRope,
    least_rope_stiffness,
    rope_mode_frequency,
    whole_opening,
)
from studies.common.result import Criterion, at_most
from studies.drive.schema import Drive
from studies.truss.motions.deployment import Deployment
from studies.truss.parts import Parts

OPEN = math.pi / 2 + 1e-6  # [rad]: beyond it the truss is taken to pass 90 deg
SHOWN = (45.0, 80.0)  # [deg] beside the motion's ends, of the mode's frequency


def rope_of(deployment: Deployment) -> Parts:
    """Stability and mode of the ropes of a deployment, its swing on them, the drive's limits."""
    drive, truss = deployment.drive, deployment.truss
    if drive is None or drive.rope_stiffness is None:
        return Parts()
    stiffness, yields = drive.rope_stiffness, drive.rope_yields
    ends = deployment.opening or whole_opening(truss)
    least = least_rope_stiffness(truss, yields, ends)
    start, end = math.degrees(ends.start), math.degrees(ends.end)
    angles = [start, *(angle for angle in SHOWN if start < angle < end), end]
    frequencies = rope_mode_frequency(truss, np.radians(angles), stiffness, yields).tolist()

    checks: tuple[Criterion, ...] = ()
    try:
        swing = deployment.rope_swing
        found, numbers = _in_words(swing, truss, drive.plan_stretch), _as_numbers(swing)
        if (behind := deployment.swing_with_one_behind) is not None:
            found += _behind_in_words(behind, drive, end)
            numbers |= {f"one_behind_{name}": value for name, value in _as_numbers(behind).items()}
        if drive.plan_stretch:
            wound = WoundRope.of(truss, deployment.law, stiffness, yields)
            found = (_wound_in_words(wound), *found)
            checks = _within_the_drive(wound, drive)
            numbers |= {
                "wound_peak_speed": wound.peak_speed,
                "wound_peak_acceleration": wound.peak_acceleration,
                "wound_end_speed": wound.end_speed,
            }
    except ModelError as error:
        found, numbers = (f"The swing of this motion on its ropes is unknown: {error}",), {}
    modes = ", ".join(
        f"{frequency:.4g} Hz at {angle:.4g} deg"
        for angle, frequency in zip(angles, frequencies, strict=True)
    )
    return Parts(
        checks=checks,
        sentences=(
            _stability(stiffness, yields, least),
            f"With the motor held, the truss at rest swings on its ropes at {modes}.",
            *found,
        ),
        details={
            "rope": {
                "least_stiffness": least.stiffness,
                "least_stiffness_angle_deg": math.degrees(least.angle),
                "mode_angle_deg": angles,
                "mode_frequency": frequencies,
                **numbers,
            }
        },
    )


def _stability(stiffness: float, yields: str, least: LeastStiffness) -> str:
    given = f"The ropes stretch {yields}, {stiffness:g} N/m each."
    if not least.stiffness:
        return f"{given} On ropes of any stiffness the truss is stable at these angles."
    return (
        f"{given} Below {least.stiffness:.4g} N/m the truss would snap through; the critical angle "
        f"is {math.degrees(least.angle):.4g} deg."
    )


def _within_the_drive(wound: WoundRope, drive: Drive) -> tuple[Criterion, ...]:
    """The drive's limits on all that it winds in: the optimum keeps them for the truss alone."""
    limits = (
        ("speed of the rope wound in", "m/s", wound.peak_speed, drive.speed),
        (
            "acceleration of the rope wound in",
            "m/s^2",
            wound.peak_acceleration,
            drive.acceleration,
        ),
    )
    return tuple(
        at_most(name, unit, value, most) for name, unit, value, most in limits if most is not None
    )


def _wound_in_words(wound: WoundRope) -> str:
    return (
        "The plan includes the stretch of the ropes: the motor winds them in with up to "
        f"{wound.peak_speed:.4g} m/s and {wound.peak_acceleration:.4g} m/s^2, and with "
        f"{wound.end_speed:.2g} m/s at both ends. Its power and torque are those for rigid ropes."
    )


def _in_words(swing: RopeSwing, truss: TrussParameters, planned: bool) -> tuple[str, ...]:
    """What the law does on such ropes, and what of that the model does not cover."""
    taken = (
        "the rope of this motion and its stretch" if planned else "the rope length for rigid ropes"
    )
    end = "" if planned else " Exports compensate for the stretch in advance."

    sentences = [
        f"If the motor winds in {taken}, the error of the angle is up to "
        f"{math.degrees(swing.angle_miss):.3g} deg and that of the rope force up to "
        f"{swing.force_miss:.3g} N; the maximum force is {swing.tension.max():.4g} N. When the "
        f"motor stops, the residual energy of the swing is {swing.energy_left:.2g} J; the truss "
        f"comes to rest at {math.degrees(swing.rest_angle):.5g} deg.{end}"
    ]

    # what the model of the swing does not cover, if it occurs
    if swing.slack > 0.0:
        sentences.append(
            f"In this swing the ropes are slack for {swing.slack:.3g} s: they carry no force then, "
            "and the model does not include how they run over their pulleys."
        )
    if swing.angle.max() > OPEN:
        sentences.append(
            f"In this swing the truss opens to {math.degrees(swing.angle.max()):.4g} deg: the "
            "model has no stop at 90 deg."
        )
    if swing.backward > 0.0 and (truss.pulley_friction > 0.0 or truss.other_pulleys):
        sentences.append(
            f"In this swing the truss moves back for {swing.backward:.3g} s: the model keeps the "
            "direction of the pulley friction, which is that of a rope being wound in."
        )
    return tuple(sentences)


def _behind_in_words(swing: RopeSwing, drive: Drive, end: float) -> tuple[str, ...]:
    """What the truss does where the motor of one rope is behind; it ends at an angle [deg]."""
    ahead, behind = swing.tension.max(axis=1)
    arrives = (
        f"does not reach {end:.4g} deg"
        if math.isnan(swing.arrival_energy)
        else f"reaches {end:.4g} deg with {swing.arrival_energy:.2g} J of kinetic energy"
    )
    slack = f" One or both are slack for {swing.slack:.3g} s." if swing.slack else ""
    return (
        f"If the motors also wind in the stretch, and one motor is {drive.rope_delay:g} s later "
        f"than the other, the truss {arrives}. The earlier rope pulls with up to {ahead:.4g} N, "
        f"the later one with up to {behind:.4g} N.{slack} The result is the same for either rope. "
        "The model does not include the twist by unequal ropes.",
    )


def _as_numbers(swing: RopeSwing) -> dict[str, float | None]:
    arrival = swing.arrival_energy
    return {
        "swing_arrival_energy": None if math.isnan(arrival) else arrival,
        "swing_angle_miss_deg": math.degrees(swing.angle_miss),
        "swing_force_miss": swing.force_miss,
        "swing_peak_force": float(swing.tension.max()),
        "swing_energy_left": swing.energy_left,
        "swing_rest_angle_deg": math.degrees(swing.rest_angle),
        "swing_slack_time": swing.slack,
        "swing_backward_time": swing.backward,
    }
