"""From a case to its result: motion in one form or both, what was measured, and the checks."""

from __future__ import annotations

import dataclasses
import logging
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.ancf.joints import Free, Locked
from ocp.arrays import Array
from studies.common.comparison_table import TableRow
from studies.common.console import Console, at_work
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series, Verdict
from studies.flex.build import FlexChain, build, variants
from studies.flex.config import FlexStudy, Form, as_dictionary
from studies.flex.drives import with_tables
from studies.flex.measures import bending, pose_frequencies, vibration
from studies.flex.motion import ChainMotion, move

DRIFT = 1e-4  # of the energy in motion; far above the integrator's own error, below what shows
GAP = 1e-6  # [m] that constraints may open
APART = 1e-5  # of the chain's length: what two forms of the same equations may differ by
MESH = 1e-2  # of the chain's length: what half the elements may change
FRAMES = 61  # poses that are kept for pictures
LOG = "models.ancf.integrate.integrator"


@dataclass(frozen=True, eq=False)
class Moved:
    """A case with its motion.

    Attributes
    ----------
    name : of its column in the table.
    flex : the models.
    motion : ChainMotion
    """

    name: str
    flex: FlexChain
    motion: ChainMotion


def run(
    study: FlexStudy, console: Console | None = None, *, kept: FinishedSteps = NOTHING_KEPT
) -> Result:
    """Move a chain of flexible links.

    Parameters
    ----------
    study : FlexStudy
    console : Console, optional
        Where lines of progress go: standard error by default. `silent()` shows none.
    kept : FinishedSteps, optional
        Where motions go to, and where those of an earlier run are read.

    Returns
    -------
    Result
        Of the kind "flex": time series of ends, joints and energies, and a column of the table
        for each form of the equations and each variant of the sweep.

    Raises
    ------
    StudyError
        If the case contradicts itself, or a step of the integrator fails.
    """
    with at_work(console) as told:
        return _answer(study, told, kept)


def _answer(study: FlexStudy, console: Console, kept: FinishedSteps) -> Result:
    study = with_tables(study, Path())
    with _progress_to(console):
        flex = build(study)
        moved = [Moved(form, flex, _moved(form, flex, form, console, kept)) for form in study.forms]
        coarse = _coarse(study, console, kept)
        swept = []
        for quantity, factor, case in variants(study):
            name = f"{quantity} x {factor:g}"
            console.progress(name)
            changed = build(case)
            step = f"{quantity} x {factor!r}"  # all digits, as two may look alike
            motion = _moved(step, changed, study.forms[0], console, kept)
            swept.append(Moved(name, changed, motion))
    return result_of(study, moved, swept, coarse)


def _moved(
    name: str, flex: FlexChain, form: Form, console: Console, kept: FinishedSteps
) -> ChainMotion:
    """The motion of a case, a step of the study; no file holds what is done at its joints."""

    def take() -> ChainMotion:
        motion = move(flex, form, console)
        locks = (joint if isinstance(joint, Locked) else Free() for joint in motion.joints)
        return dataclasses.replace(motion, joints=tuple(locks))

    found = kept.step(name, take, say=console.progress)
    pairs = zip(found.joints, flex.joints, strict=True)
    joints = tuple(last if isinstance(last, Locked) else first for last, first in pairs)
    return dataclasses.replace(found, joints=joints)


def check(study: FlexStudy, console: Console | None = None) -> None:
    """Refuse a case that contradicts itself, and all its variants, before any work."""
    study = with_tables(study, Path())
    build(study)
    for _, _, case in variants(study):
        build(case)


@contextmanager
def _progress_to(console: Console) -> Iterator[None]:
    """Show what the integrator logs as a line of progress."""

    class ProgressHandler(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            console.live(record.getMessage())

    logger, handler = logging.getLogger(LOG), ProgressHandler()
    level, passed_on = logger.level, logger.propagate
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    logger.propagate = False
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)
        logger.propagate = passed_on


def _coarse(study: FlexStudy, console: Console, kept: FinishedSteps) -> ChainMotion | None:
    """The motion with half the elements, if mesh_check is set."""
    if not study.mesh_check or study.elements < 2:
        return None
    half = dataclasses.replace(study, elements=study.elements // 2)
    name = f"with {half.elements} elements a link"
    console.progress(name)
    return _moved(name, build(half), study.forms[0], console, kept)


def result_of(
    study: FlexStudy,
    moved: Sequence[Moved],
    swept: Sequence[Moved],
    coarse: ChainMotion | None = None,
) -> Result:
    """The result of the motions."""
    first = moved[0]
    columns = [*moved, *swept]
    frequencies, remarks = _frequencies(study, first)
    checks = _checks(study, moved, swept, coarse)

    drift = first.motion.drift / first.motion.scale
    said = f"simulated, not optimised; the energy drifts by {drift:.1e} of its largest value"
    if len(moved) > 1:
        said += f", both forms agree to {_apart(moved):.1e} m"

    return Result(
        kind="flex",
        question=study.question,
        configuration=as_dictionary(study),
        arrays={**_series(first, moved), **_poses(first.motion)},
        table=_table(columns),
        verdict=Verdict("measured", said),
        checks=tuple(checks),
        remarks=(*_event_lines(first.motion), *remarks),
        details={
            "profile_of": first.name,
            "events": [dataclasses.asdict(event) for event in first.motion.events],
            "frequencies": frequencies,
            "start": first.flex.angles.tolist(),
            "poses": {"frames": FRAMES, "points": _points(first.motion)},
            "integrator": {case.name: {"steps": case.motion.steps} for case in columns},
        },
        provenance=provenance(),
    )


def _frequencies(study: FlexStudy, moved: Moved) -> tuple[dict[str, list[float]], list[str]]:
    """Natural frequencies [Hz] in the poses of start and end, without gravity."""
    if not study.frequencies:
        return {}, []
    flex, motion = moved.flex, moved.motion
    found, remarks = {}, []
    for when, joints, angles, t in (
        ("start", flex.joints, flex.angles, 0.0),
        ("end", motion.joints, motion.angles[:, -1], study.time),
    ):
        values, remark = pose_frequencies(flex.chain, joints, angles, study.frequencies, t)
        found[when] = values.tolist()
        if remark:
            remarks.append(f"frequencies at the {when}: {remark}")
    lines = [
        f"natural frequencies at the {when}: "
        + ", ".join(f"{value:.5g}" for value in values)
        + " Hz"
        for when, values in found.items()
        if values
    ]
    return found, [*lines, *remarks]


def _event_lines(motion: ChainMotion) -> list[str]:
    return [
        f"joint {event.joint} locks by {event.by} at {event.time:.6g} s and "
        f"{math.degrees(event.angle):.6g} deg; {event.lost:.4g} J are lost"
        for event in motion.events
    ]


def _checks(
    study: FlexStudy, moved: Sequence[Moved], swept: Sequence[Moved], coarse: ChainMotion | None
) -> list[Criterion]:
    length = sum(link.length for link in study.links)
    found = []
    for case in (*moved, *swept):
        motion = case.motion
        drift, gap = motion.drift, float(motion.violation.max())
        limit = DRIFT * motion.scale
        found.append(
            Criterion(f"{case.name}: drift of the energy", "J", drift, limit, drift <= limit)
        )
        found.append(Criterion(f"{case.name}: constraint violation", "m", gap, GAP, gap <= GAP))
        caught = {event.joint for event in motion.events}
        for place, joint in enumerate(study.joint):
            if joint.latch_deg is not None and joint.lock_time is None:
                found.append(_latch_check(case, place, joint.latch_deg, place in caught))
    if len(moved) > 1:
        apart, limit = _apart(moved), APART * length
        found.append(Criterion("distance between both forms", "m", apart, limit, apart <= limit))
    if coarse is not None:
        apart, limit = _apart([moved[0].motion, coarse]), MESH * length
        name = f"change of the ends of the links with {study.elements // 2} elements"
        found.append(Criterion(name, "m", apart, limit, apart <= limit))
    return found


def _latch_check(case: Moved, place: int, latch_deg: float, caught: bool) -> Criterion:
    angles = np.degrees(case.motion.angles[place])
    nearest = float(np.abs(angles - latch_deg).min())
    where = f"joint {place} at {latch_deg:g} deg"
    if caught:
        sentence = f"passed: the latch catches {where}"
    else:
        sentence = f"FAILED: no latch catches {where}, the closest approach is {nearest:.3g} deg"
    return Criterion(f"{case.name}: latch of joint {place}", "deg", nearest, 0.0, caught, sentence)


def _apart(moved: Sequence[Moved | ChainMotion]) -> float:
    """Largest distance of a link's end between two motions at the same instants [m]."""
    motions = [case.motion if isinstance(case, Moved) else case for case in moved[:2]]
    grid = np.intersect1d(motions[0].times, motions[1].times)
    places = [np.searchsorted(motion.times, grid) for motion in motions]
    links = range(len(motions[0].chain.links))
    return max(
        float(np.hypot(*(motions[0].end(k)[:, places[0]] - motions[1].end(k)[:, places[1]])).max())
        for k in links
    )


def _table(columns: Sequence[Moved]) -> tuple[TableRow, ...]:
    """The quantities of all motions."""
    rows: dict[str, tuple[str, str, dict[str, float]]] = {}
    for case in columns:
        for key, title, unit, value in _quantities(case):
            rows.setdefault(key, (title, unit, {}))[2][case.name] = float(value)
    return tuple(TableRow(key, title, unit, values) for key, (title, unit, values) in rows.items())


def _quantities(case: Moved) -> Iterator[tuple[str, str, str, float]]:
    """Key, title, unit and value of each quantity of a motion."""
    motion = case.motion
    links = range(len(motion.chain.links))
    yield "duration", "duration", "s", motion.times[-1]

    # a lock is a blow of its own: what vibrates before it is the motion's
    until = motion.events[0].time if motion.events else motion.times[-1]
    free = motion.times <= until
    for k in links:
        bent = bending(motion.chain, motion.q, k)
        swing = vibration(motion.times[free], bent[free])
        yield f"bending_{k}", f"maximum bending of link {k}", "m", np.abs(bent).max()
        yield f"vibration_{k}", f"vibration of link {k}, until a lock", "m", swing
    for k in links:
        final, torque = math.degrees(motion.angles[k, -1]), np.abs(motion.torques[k]).max()
        yield f"angle_{k}", f"angle of joint {k} at the end", "deg", final
        yield f"torque_{k}", f"maximum torque of joint {k}", "N m", torque

    x, y = motion.end(len(links) - 1)[:, -1]
    yield "tip_x", "x of the tip at the end", "m", x
    yield "tip_y", "y of the tip at the end", "m", y

    left = motion.kinetic[-1] + motion.strain[-1]
    yield "kinetic", "maximum kinetic energy", "J", motion.kinetic.max()
    yield "left", "kinetic and strain energy at the end", "J", left
    yield "lost", "energy lost by locks", "J", motion.lost[-1]

    yield "frequency", "first natural frequency at the end", "Hz", _first_frequency(case)
    yield "drift", "drift of the energy", "J", motion.drift
    yield "gap", "largest constraint violation", "m", motion.violation.max()


def _first_frequency(case: Moved) -> float:
    motion = case.motion
    angles, end = motion.angles[:, -1], float(motion.times[-1])
    values, _ = pose_frequencies(motion.chain, motion.joints, angles, 1, end)
    return float(values[0]) if values.size else float("nan")


def _series(first: Moved, moved: Sequence[Moved]) -> dict[str, Series]:
    """The time series of the first motion, and how far the other form is from it."""
    motion = first.motion

    def along(unit: str, values: Array, meaning: str) -> Series:
        return Series(unit, "time", values, meaning)

    series = {"time": along("s", motion.times, "since the start; twice where a joint locks")}
    for k in range(len(motion.chain.links)):
        x, y = motion.end(k)
        bent = bending(motion.chain, motion.q, k)
        series |= {
            f"x_{k}": along("m", x, f"x of the end of link {k}"),
            f"y_{k}": along("m", y, f"y of the end of link {k}"),
            f"bending_{k}": along("m", bent, f"end of link {k} across the tangent at its start"),
            f"angle_{k}": along("rad", motion.angles[k], f"angle of joint {k}"),
            f"torque_{k}": along("N m", motion.torques[k], f"torque of joint {k}"),
            f"work_{k}": along("J", motion.work[k], f"work of joint {k} since the start"),
        }
    for name, meaning in (
        ("kinetic", "kinetic energy"),
        ("strain", "strain energy"),
        ("gravity", "energy of gravity, zero at the root"),
        ("dissipated", "energy lost to damping since the start"),
        ("lost", "energy lost by locks since the start"),
    ):
        series[name] = along("J", getattr(motion, name), meaning)
    defect = motion.balance - motion.balance[0]
    series["defect"] = along("J", defect, "error of the energy balance")
    series["violation"] = along("m", motion.violation, "largest constraint violation")
    if len(moved) > 1:
        series |= _difference(moved)
    return series


def _difference(moved: Sequence[Moved]) -> dict[str, Series]:
    """Distance of the tip between both forms, at the times that both have."""
    one, other = (case.motion for case in moved[:2])
    grid = np.intersect1d(one.times, other.times)
    tip = len(one.chain.links) - 1
    paths = [motion.end(tip)[:, np.searchsorted(motion.times, grid)] for motion in (one, other)]
    apart = np.hypot(*(paths[0] - paths[1]))
    gap = other.violation[np.searchsorted(other.times, grid)]
    return {
        "compared": Series("s", "compared", grid, "times of both forms"),
        "apart": Series("m", "compared", apart, "distance between the tips of both forms"),
        "gap_index_1": Series("m", "compared", gap, "constraint violation in the index-1 form"),
    }


def _points(motion: ChainMotion) -> int:
    return motion.chain.nodes * len(motion.chain.links)


def _poses(motion: ChainMotion) -> dict[str, Series]:
    """Positions of all nodes at even times, one pose after the other."""
    wanted = np.linspace(0.0, motion.times[-1], FRAMES)
    places = np.clip(np.searchsorted(motion.times, wanted), 0, motion.times.size - 1)
    x, y = motion.q[0::4, places], motion.q[1::4, places]
    number = np.arange(x.size, dtype=float)
    repeated = np.repeat(motion.times[places], x.shape[0])
    return {
        "pose": Series("1", "pose", number, "nodes of all links, one pose after the other"),
        "pose_time": Series("s", "pose", repeated, "when"),
        "pose_x": Series("m", "pose", x.T.ravel(), "x of a node"),
        "pose_y": Series("m", "pose", y.T.ravel(), "y of a node"),
    }
