"""Where motion laws come from: the paper, a solution, a stored result."""

from __future__ import annotations

import functools
import itertools
import math
import warnings
from collections.abc import Mapping

import numpy as np

from models.laws import (
    Bezier,
    Hermite,
    Law,
    Piecewise,
    Step5,
    linear_jerk,
    paper_points,
)
from models.ring_on_arm import RingOnArm
from models.truss import Opening, TrussParameters, whole_opening
from ocp import Control, Solution
from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.common.result import Result
from studies.drive.schema import Drive
from studies.margin.schema import MarginRequirements
from studies.truss.config import DEPLOYED, TrussStudy, study_from
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.integrated import integrated_law, replayed_law
from studies.truss.problem import Statement

SHORTEST = 1e-12  # of the duration: shorter intervals are left out

EXACT = 1e-9  # [rad]: jerks that integrate to the angles this closely are the law's own
FITTING = 1e-4  # [rad], in sum: speeds and accelerations that give the steps of the angle are used
RATES = ("angular_speed", "angular_acceleration")
BEFORE = "angular_acceleration_before"
OPTIMUM = "optimal"  # beside a profile that was checked, whose columns have their own names
JERKS = ("angular_jerk", "angular_jerk_before")


@functools.lru_cache(maxsize=8)
def paper_laws(
    truss: TrussParameters,
    duration: float,
    drive: Drive | None = None,
    margin: MarginRequirements | None = None,
    carrier: RingOnArm | None = None,
    opening: Opening | None = None,
) -> tuple[Deployment, Deployment]:
    """The paper's Bezier law, its ends pinned to the exact angles, and its Step5; from rest.

    They remember their values, which a study asks for several times.
    """
    ends = opening or whole_opening(truss)
    laws: dict[str, Law] = {
        "Bezier": pinned_bezier(truss, duration, ends),
        "Step5": Step5(duration, ends.start, ends.end),
    }
    bezier, step5 = (
        Deployment(name, law, truss, drive, margin, carrier=carrier, opening=opening)
        for name, law in laws.items()
    )
    return bezier, step5


def paper_laws_of(study: TrussStudy, duration: float) -> tuple[Deployment, ...]:
    """The paper's laws with all that a study states; none beside a motion under way at its start.

    They start at rest.
    """
    return () if study.opening.rate else laws_from_rest(study, duration)


def laws_from_rest(study: TrussStudy, duration: float) -> tuple[Deployment, Deployment]:
    """The paper's laws between the angles of a study, from rest whatever its motion does."""
    of_study = (study.drive, study.margin, study.ring_on_arm, study.opening)
    return paper_laws(study.truss, duration, *of_study)


def deployment_of(name: str, law: Law, study: TrussStudy) -> Deployment:
    """A law with all that a study states."""
    of_study = (study.truss, study.drive, study.margin)
    return Deployment(name, law, *of_study, carrier=study.ring_on_arm, opening=study.opening)


def deployments_of(result: Result) -> list[Deployment]:
    """The law of a result, the optimum stored beside it, and the paper's laws, of its study.

    Raises
    ------
    StudyError
        If the result has no profile.
    """
    study, law = study_of(result), law_of_result(result)
    laws, columns = {result.laws[0]: law}, _columns_of(result)
    if f"{OPTIMUM}/time" in columns:
        time, angle, speed, after, before = (
            columns[f"{OPTIMUM}/{name}"] for name in ("time", "angle", *RATES, BEFORE)
        )
        laws[OPTIMUM] = Hermite(time, angle, speed, after, before)
    own = (deployment_of(name, one, study) for name, one in laws.items())
    return [*own, *paper_laws_of(study, law.duration)]


def _columns_of(result: Result) -> dict[str, Array]:
    return {name: series.values for name, series in result.arrays.items()}


def law_of_result(result: Result) -> Law:
    """The law of a result.

    Raises
    ------
    StudyError
        If the result has no profile.
    """
    columns = _columns_of(result)
    if "angle" not in columns:
        raise StudyError("the result contains no profile to draw; run its study again")
    return stored_law(columns)


def study_of(result: Result) -> TrussStudy:
    """The study on whose truss a result moves: what was found of a design, else what was asked.

    What the model warns of was said when the study was stated.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return study_from(result.details.get("study", result.configuration))


def pinned_bezier(
    truss: TrussParameters, duration: float, opening: Opening | None = None
) -> Bezier:
    """The paper's Bezier law from rest, its ends pinned to the exact angles."""
    ends = opening or whole_opening(truss)
    return Bezier(duration, paper_points(ends.start, ends.end))


def law_of(study: TrussStudy, statement: Statement, solution: Solution) -> Law:
    """The law of a solution.

    With jerk or acceleration as the control it is the exact integral of that control, whatever the
    collocation polynomials say; else of the acceleration of the engine's replay.
    """
    jerk = statement.signals.jerk
    if isinstance(statement.signals.acceleration, Control):
        return integrated_law(study, statement.signals.acceleration.name, solution)
    if jerk is None:
        return replayed_law(study, statement, solution)

    edges: list[float] = [0.0]
    ramps: list[tuple[float, float]] = []
    for phase in solution.trajectory.phases:
        shortest = SHORTEST * phase.breakpoints[-1]
        values = phase.polynomial(jerk.name).ends()[:, :, 0]
        for (begin, end), (first, last) in zip(
            itertools.pairwise(phase.breakpoints), values, strict=True
        ):
            if end - begin > shortest:
                edges.append(float(end))
                ramps.append((float(first), float(last)))
    opening, steep = study.opening, 0.0
    if opening.rate:
        acceleration = solution.trajectory.phases[0].polynomial(statement.signals.acceleration.name)
        steep = float(acceleration.ends()[0, 0, 0])
    return linear_jerk(tuple(edges), tuple(ramps), opening.start, opening.rate, steep)


def knots(law: Law) -> dict[str, Array]:
    """What a law of piecewise linear jerk is made of, shape (m,) each; empty for other laws."""
    if not isinstance(law, Piecewise):
        return {}
    edges = np.array(law.edges)
    after = law.motion(edges)
    return {
        "knot": edges,
        "knot_angle": after.angle,
        "knot_jerk": after.jerk,
        "knot_jerk_before": law.motion(np.nextafter(edges, 0.0)).jerk,
    }


def stored_law(columns: Mapping[str, Array]) -> Law:
    """The law of the columns of a result: exact where there are knots that give its angles.

    Where no row runs backwards, or beyond the open truss, the law does not either: no model holds
    there.
    """
    if "knot" in columns:
        renamed = (columns["knot"], columns["knot_jerk"], columns["knot_jerk_before"])
        jerks = dict(zip(("time", *JERKS), renamed, strict=True))
        starts = (float(columns[name][0]) for name in RATES)
        exact = exact_law(jerks, columns["knot_angle"], *starts)
        if exact is not None:
            return exact

    # formerly there was no column of accelerations before the rows
    after = columns["angular_acceleration"]
    before = columns.get(BEFORE, after)
    angles, speeds = columns["angle"], columns["angular_speed"]
    forwards, inside = bool((speeds >= 0.0).all()), bool((angles <= DEPLOYED).all())
    highest = DEPLOYED if inside else math.inf
    return Hermite(
        columns["time"], angles, speeds, after, before, forwards=forwards, highest=highest
    )


def rows_law(columns: Mapping[str, Array], angles: Array) -> Hermite | None:
    """The law through rows of angle, speed and acceleration, if these fit each other.

    Raises
    ------
    ModelError
        If the rows make no law.
    """
    rates = [columns.get(name) for name in (*RATES, BEFORE)]
    if any(column is None or not np.isfinite(column).all() for column in rates):
        return None
    speeds, after, before = (np.asarray(column) for column in rates)
    law = Hermite(columns["time"], angles, speeds, after, before)

    # Euler and Maclaurin's rule: what speeds and accelerations say of each step of the angle
    h = np.diff(columns["time"])
    steps = h * (speeds[:-1] + speeds[1:]) / 2 + h**2 * (after[:-1] - before[1:]) / 12
    return law if np.abs(np.diff(angles) - steps).sum() <= FITTING else None


def exact_law(
    columns: Mapping[str, Array], angles: Array, speed: float = 0.0, acceleration: float = 0.0
) -> Piecewise | None:
    """The law of piecewise linear jerk, if the columns of jerks reproduce the angles.

    Parameters
    ----------
    speed, acceleration : at the start [rad/s, rad/s^2].
    """
    after, before = (columns.get(name) for name in JERKS)
    if after is None or before is None or not np.isfinite([after, before]).all():
        return None
    ramps = tuple(zip(after[:-1].tolist(), before[1:].tolist(), strict=True))
    times, start = tuple(columns["time"].tolist()), float(angles[0])
    law = linear_jerk(times, ramps, start, speed, acceleration)
    miss = np.abs(law.motion(columns["time"]).angle - angles).max()
    return law if miss <= EXACT else None
