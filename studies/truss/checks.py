"""The table of a motion and of what it is compared with, and all that it is held against."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from models.truss import evaluate_motion, rope_length, static_peak
from ocp import Solution
from studies.common.comparison_table import TableRow
from studies.common.result import Criterion, at_most
from studies.drive.motor import motor_torque
from studies.truss.config import DEPLOYED, TrussStudy
from studies.truss.limits.caps import cap_on
from studies.truss.limits.tolerances import ANGLE_MISS, CAPS, IMBALANCE, LONGER, REST, TENSION
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import laws_from_rest
from studies.truss.quantities import OBJECTIVES, QUANTITIES, Quantity

BEYOND = "the violation of"  # what is said of a value within the tolerance of its cap
ARM_ROWS = 1201  # even instants at which what the arm does is looked at


def table_rows(
    study: TrussStudy, laws: Sequence[Deployment], bounds: Mapping[str, float]
) -> tuple[TableRow, ...]:
    """All quantities of the laws, with caps and bounds."""
    broken = {deployment.name: broken_caps(study, deployment.values) for deployment in laws}
    alone = {next(iter(stage)) for stage in study.minimise if len(stage) == 1}

    rows = [
        TableRow(
            key=key,
            title=QUANTITIES[key].title,
            unit=QUANTITIES[key].unit,
            values={deployment.name: deployment.values[key] for deployment in laws},
            cap=cap_of(study, key),
            bound=bounds.get(key),
            minimised=key in alone,
            better=QUANTITIES[key].better,
            broken_by=tuple(name for name, excess in broken.items() if key in excess),
        )
        for key in QUANTITIES
        if key in laws[0].values
    ]
    return (*_weighted_sums(study, laws), *rows)


def _weighted_sums(study: TrussStudy, laws: Sequence[Deployment]) -> list[TableRow]:
    """A row for each weighted sum of objectives, each in units of the Bezier law's value."""
    sums = [stage for stage in study.minimise if len(stage) > 1]
    if not sums:
        return []
    sizes = objective_sizes(study)
    return [
        TableRow(
            key=f"weighted-sum-{place}" if len(sums) > 1 else "weighted-sum",
            title=f"weighted sum of {' and '.join(stage)}",
            unit="1",
            values={
                law.name: sum(
                    weight * law.values[name] / sizes[name] for name, weight in stage.items()
                )
                for law in laws
            },
            minimised=True,
            better="less",
        )
        for place, stage in enumerate(sums, start=1)
    ]


def objective_sizes(study: TrussStudy) -> dict[str, float]:
    """Sizes that make weighted objectives comparable: the Bezier law's values."""
    bezier, _ = laws_from_rest(study, study.duration[1])
    return {name: bezier.values[name] for name in OBJECTIVES if name in bezier.values}


def cap_of(study: TrussStudy, key: str) -> float | None:
    """The cap that the quantity `key` has to keep, if there is one."""
    return cap_on(study.caps, study.drive, key)


def broken_caps(study: TrussStudy, values: Mapping[str, float]) -> dict[str, float]:
    """Caps that these values break, and by how much: relative to the cap.

    A rope that pushes, with a least tension of 0, does so relative to the peak rope force.
    """
    broken = {}
    for key, quantity in QUANTITIES.items():
        cap, value = cap_of(study, key), values.get(key, math.nan)
        if cap is None or math.isnan(value):
            continue
        # a tension is a small share of the motor's force, and accurate to a share of it
        least = quantity.kind == "least"
        excess = cap - value if least else value - cap
        allowed = TENSION * values["peak-force"] if least else CAPS * cap
        if excess > allowed:
            broken[key] = excess / (cap or values["peak-force"])
    return broken


def judged(study: TrussStudy) -> frozenset[str]:
    """Quantities that `criteria` reads: what is capped, and the sizes that misses are parts of."""
    capped = {key for key in QUANTITIES if cap_of(study, key) is not None}
    return frozenset({"peak-speed", "peak-acceleration", "peak-force", *capped})


def criteria(
    study: TrussStudy, deployment: Deployment, angle_miss: float = ANGLE_MISS
) -> tuple[Criterion, ...]:
    """All that a deployment is held against.

    Parameters
    ----------
    angle_miss : float
        Largest miss of the end angles that passes [rad].
    """
    return (
        *_at_the_ends(study, deployment, angle_miss),
        *_under_the_caps(study, deployment),
        at_most("energy imbalance", "1", deployment.energies.imbalance, IMBALANCE),
    )


def _at_the_ends(study: TrussStudy, deployment: Deployment, angle_miss: float) -> list[Criterion]:
    """Between the right angles, from rest or the rate that is stated to rest, in time."""
    duration, opening = deployment.law.duration, study.opening
    ends = deployment.law.motion(np.array([0.0, duration]))
    misses = np.abs(ends.angle - np.array([opening.start, opening.end]))
    low, high = study.duration
    rest = REST * deployment.values["peak-speed"]
    off, (first, last) = np.abs(ends.speed - np.array([opening.rate, 0.0])), end_names(study)

    held = [
        at_most(f"miss of the {first} angle", "rad", misses[0], angle_miss),
        at_most(f"miss of the {last} angle", "rad", misses[1], angle_miss),
        at_most(
            "miss of the speed at the ends" if opening.rate else "speed at the ends",
            "rad/s",
            off.max(),
            rest,
        ),
        at_most("duration", "s", duration, high * (1 + LONGER)),
    ]
    if duration < low * (1 - LONGER):
        held.append(Criterion("duration (least)", "s", duration, low, False))
    if study.jerk_limited:  # else zero acceleration means nothing
        still = REST * deployment.values["peak-acceleration"]
        worst = np.abs(ends.acceleration[1 if opening.rate else 0 :]).max()
        where = "end" if opening.rate else "ends"
        held.append(at_most(f"acceleration at the {where}", "rad/s^2", worst, still))
    return held


def end_names(study: TrussStudy) -> tuple[str, str]:
    """What the angles at both ends of a motion are called."""
    start, end = study.opening.start, study.opening.end
    first = "stowed" if start == study.truss.stowed_angle else "start"
    return first, "deployed" if end == DEPLOYED else "end"


def _under_the_caps(study: TrussStudy, deployment: Deployment) -> list[Criterion]:
    """Every cap on the motion; a value that is beyond it by less than the tolerance says so."""
    values = deployment.values
    broken = broken_caps(study, values)
    return [
        Criterion(
            name=quantity.title,
            unit=quantity.unit,
            value=values[key],
            limit=cap,
            passed=key not in broken,
            sentence=_barely(quantity, values[key], cap) if key not in broken else "",
        )
        for key, quantity in QUANTITIES.items()
        if key in values and (cap := cap_of(study, key)) is not None
    ]


def _barely(quantity: Quantity, value: float, cap: float) -> str:
    """What to say of a value that is beyond its cap, but within the tolerance; else nothing."""
    beyond = cap - value if quantity.kind == "least" else value - cap
    if not beyond > 0.0:
        return ""
    share, of = (TENSION, "of the peak rope force") if quantity.kind == "least" else (CAPS, "of it")
    return (
        f"passed: {quantity.title} {value:.9g} {quantity.unit} (limit {cap:.9g}); {BEYOND} "
        f"{beyond:.2g} {quantity.unit} is within the tolerance of {share:g} {of}"
    )


def tolerated(study: TrussStudy, deployment: Deployment) -> list[str]:
    """Sentences on caps that are exceeded, though within their tolerance."""
    return [
        check.sentence for check in _under_the_caps(study, deployment) if BEYOND in check.sentence
    ]


def start_in_words(study: TrussStudy) -> tuple[str, ...]:
    """What a motion that is under way at its start leaves open."""
    if not study.opening.rate:
        return ()
    return (
        f"The ring turns at {study.start_rate_deg_per_s:g} deg/s at the start. Its acceleration "
        "is free there, because the rope forces before the start are unknown. The laws of the "
        "paper start at rest, so none of them is compared with this motion.",
    )


def restart_in_words(deployment: Deployment) -> tuple[str, ...]:
    """What a motor with a rotor needs without momentum, beside what it needs with it."""
    peak, drive = deployment.values.get("peak-motor-force"), deployment.drive
    if peak is None or drive is None:
        return ()
    truss = deployment.truss
    ridge = static_peak(truss, deployment.opening)
    wound = float(rope_length(truss, truss.stowed_angle) - rope_length(truss, ridge.angle))
    torque = float(motor_torque(drive, ridge.force, wound))
    return (
        f"The motor's force is at most {peak:.4g} N, its rotor included. To restart from "
        f"standstill at {math.degrees(ridge.angle):.2f} deg it needs {ridge.force:.4g} N, "
        f"{torque:.4g} N m at its shaft, because it has no momentum there.",
    )


def arm_in_words(deployment: Deployment) -> tuple[str, ...]:
    """What the arm does to the ring, and what is left out of it."""
    arm = deployment.arm
    if arm is None:
        return ()
    time = np.linspace(0.0, deployment.law.duration, ARM_ROWS)
    moved = deployment.law.motion(time)
    held = evaluate_motion(deployment.truss, moved.angle, moved.speed, moved.acceleration)
    added = float(np.abs(deployment.at(time)[1].rope_force - held.rope_force).max())
    tip = 1e3 * float(np.abs(arm.tip(time)[1]).max())
    stowed, opened = (
        f"{float(arm.model.frequencies(angle)[0]):.3g}"
        for angle in (deployment.law.start_angle, DEPLOYED)
    )
    satellite = "a satellite that is held"
    if (H := arm.model.satellite_inertia) is not None:
        turned = math.degrees(float(arm.satellite_turn(deployment.law.duration)[0]))
        satellite = f"a satellite of {H:g} kg m^2 that turns by {turned:.4g} deg"
    return (
        f"While the ring opens, the tip of the arm moves by up to {tip:.3g} mm across it and "
        f"changes the rope force by up to {added:.3g} N; the arm's first frequency falls from "
        f"{stowed} to {opened} Hz.",
        f"The arm is straight, its root is locked to {satellite}, and its elbow is locked. The "
        "satellite does not translate. The reaction on the arm and the forces in the bars are "
        "those of a ring on a tip that is held.",
    )


def engine_criterion(solution: Solution) -> Criterion:
    """What the engine says of its own answer."""
    verification = solution.verification

    if verification.passed:
        sentence = "passed: the engine's replay and its evaluation between the points"
    else:
        sentence = f"FAILED: the engine's verification: {'; '.join(verification.reasons)}"

    return Criterion(
        name="the engine's verification",
        unit="1",
        value=verification.miss,
        limit=math.nan,
        passed=verification.passed,
        sentence=sentence,
    )
