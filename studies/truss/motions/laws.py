"""Where motion laws come from: the paper, a solution, a stored result."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np

from models.laws import (
    PAPER_POINTS,
    Bezier,
    Hermite,
    Law,
    Piecewise,
    Step5,
    linear_jerk,
    pinned,
)
from models.truss import TrussParameters
from ocp import Control, Solution
from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.common.result import Result
from studies.drive.schema import Drive
from studies.margin.schema import MarginRequirements
from studies.truss.config import DEPLOYED, TrussStudy, study_from
from studies.truss.expressions import acceleration_in
from studies.truss.motions.deployment import Deployment
from studies.truss.problem import Statement

EXACT_DEGREE = 3  # of an acceleration between two rows that give angle, speed and acceleration
ROWS_AN_INTERVAL = 16  # of a replay: the force is then good to 1e-8 between them
# of Gauss and Legendre between two rows, from 0 to 1; of an order beyond that of the law there
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)
GAUSS_POINTS, GAUSS_WEIGHTS = (1.0 + _POINTS) / 2.0, _WEIGHTS / 2.0
JOINT = 1e-9  # of the duration: intervals of a replay that are shorter are left out
SHORTEST = 1e-12  # of the duration: shorter intervals are left out

EXACT = 1e-9  # [rad]: jerks that integrate to the angles this closely are the law's own
FITTING = 1e-4  # [rad], in sum: speeds and accelerations that give the steps of the angle are used
RATES = ("angular_speed", "angular_acceleration")
BEFORE = "angular_acceleration_before"
JERKS = ("angular_jerk", "angular_jerk_before")


@functools.lru_cache(maxsize=8)
def paper_laws(
    truss: TrussParameters,
    duration: float,
    drive: Drive | None = None,
    margin: MarginRequirements | None = None,
) -> tuple[Deployment, Deployment]:
    """The paper's Bezier law, its ends pinned to the exact angles, and its Step5.

    They remember their values, which a study asks for several times.
    """
    return (
        Deployment("Bezier", pinned_bezier(truss, duration), truss, drive, margin),
        Deployment("Step5", Step5(duration, truss.stowed_angle, DEPLOYED), truss, drive, margin),
    )


def deployments_of(result: Result) -> list[Deployment]:
    """The law of a result and the paper's laws, on the truss of its study.

    Raises
    ------
    StudyError
        If the result has no profile.
    """
    study, law = study_of(result), law_of_result(result)
    own = Deployment(result.laws[0], law, study.truss, study.drive, study.margin)
    return [own, *paper_laws(study.truss, law.duration, study.drive, study.margin)]


def law_of_result(result: Result) -> Law:
    """The law of a result.

    Raises
    ------
    StudyError
        If the result has no profile.
    """
    columns = {name: series.values for name, series in result.arrays.items()}
    if "angle" not in columns:
        raise StudyError("the result has no profile to draw; run its study again")
    return stored_law(columns)


def study_of(result: Result) -> TrussStudy:
    """The study on whose truss a result moves: what was found of a design, else what was asked."""
    return study_from(result.details.get("study", result.configuration))


def pinned_bezier(truss: TrussParameters, duration: float) -> Bezier:
    """The paper's Bezier law, its ends pinned to the exact angles."""
    return Bezier(duration, pinned(PAPER_POINTS, truss.stowed_angle, DEPLOYED))


def law_of(study: TrussStudy, statement: Statement, solution: Solution) -> Law:
    """The law of a solution.

    With jerk or acceleration as the control it is the exact integral of that control from rest,
    whatever the collocation polynomials say; else of the acceleration of the engine's replay.
    """
    jerk = statement.signals.jerk
    if isinstance(statement.signals.acceleration, Control):
        return _integrated_law(study, statement.signals.acceleration.name, solution)
    if jerk is None:
        return _replayed_law(study, statement, solution)

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
    return linear_jerk(tuple(edges), tuple(ramps), start_angle=study.truss.stowed_angle)


def _integrated_law(study: TrussStudy, acceleration: str, solution: Solution) -> Hermite:
    """The exact integral of an acceleration that is a polynomial in each interval.

    A replay's angles are good to 1e-11, and second differences of close rows would amplify that. So
    do those of rounded angles: there are no more rows than the polynomials need.
    """
    pieces, gains, turns = [], [], []
    shortest = JOINT * solution.trajectory.phases[-1].end
    for phase in solution.trajectory.phases:
        powers = phase.polynomial(acceleration).powers()[:, 0, :]
        for begin, end, coefficients in zip(
            phase.breakpoints[:-1], phase.breakpoints[1:], powers, strict=True
        ):
            width = end - begin
            if width <= shortest:
                continue
            rate = np.polynomial.Polynomial(coefficients)
            degree = int(np.flatnonzero(coefficients).max(initial=0))
            rows = 1 if degree <= EXACT_DEGREE else ROWS_AN_INTERVAL
            tau = np.linspace(0.0, 1.0, rows + 1)
            once, twice = rate.integ()(tau), rate.integ(2)(tau)
            pieces.append(np.column_stack([begin + width * tau, rate(tau)]))
            gains.append(width * np.diff(once))
            turns.append(width**2 * (np.diff(twice) - np.diff(tau) * once[:-1]))
    return _hermite(study, pieces, np.concatenate(gains), np.concatenate(turns))


def _replayed_law(study: TrussStudy, statement: Statement, solution: Solution) -> Hermite:
    """The integral of the acceleration of the replay, for a solution whose control is a force.

    The acceleration is computed once, at rows so close that the law between them is as accurate as
    the replay itself. Whoever asks for the motion then needs no expression any more. It is not that
    of the replay's angles, whose second differences between close rows are noise: the force that
    follows from them was off by 1e-5 of its peak.
    """
    signals = statement.signals
    within = (np.arange(ROWS_AN_INTERVAL)[:, None] + np.append(0.0, GAUSS_POINTS)).ravel()
    tau = np.append(within / ROWS_AN_INTERVAL, 1.0)
    shortest = JOINT * solution.replayed.phases[-1].end

    pieces, gains, turns = [], [], []
    for motion, net in zip(solution.replayed.phases, statement.nets, strict=True):
        kept = np.flatnonzero(np.diff(motion.breakpoints) > shortest)
        values = solution.evaluator.values(
            solution.replayed,
            motion.name,
            [acceleration_in(signals, net)],
            np.repeat(kept, tau.size),
            np.tile(tau, kept.size),
        ).reshape(kept.size, tau.size)

        # Gauss's rule between rows, for the integral and for the integral of the integral
        width = np.diff(motion.breakpoints)[kept, None] / ROWS_AN_INTERVAL
        inner = values[:, :-1].reshape(kept.size, ROWS_AN_INTERVAL, -1)[:, :, 1:]
        gains.append((width * (inner @ GAUSS_WEIGHTS)).ravel())
        turns.append((width**2 * (inner @ (GAUSS_WEIGHTS * (1.0 - GAUSS_POINTS)))).ravel())

        times = motion.breakpoints[kept][:, None] + width * np.arange(ROWS_AN_INTERVAL + 1)
        pieces += list(np.dstack([times, values[:, :: 1 + GAUSS_POINTS.size]]))
    return _hermite(study, pieces, np.concatenate(gains), np.concatenate(turns))


def _hermite(study: TrussStudy, pieces: Sequence[Array], gains: Array, turns: Array) -> Hermite:
    """The law from rest through rows of time and acceleration, (rows, 2) of each interval.

    Parameters
    ----------
    gains, turns : of all steps from row to row, as of `models.laws.Hermite`.
    """
    # the last row of an interval gives way to the first one of the next, but for the acceleration
    times, after = np.vstack([*(rows[:-1] for rows in pieces), pieces[-1][-1]]).T
    before = np.concatenate([pieces[0][:1, 1], *(rows[1:, 1] for rows in pieces)])
    times[0], after[-1] = 0.0, before[-1]

    speeds = np.cumsum(np.append(0.0, gains))
    steps = np.diff(times) * speeds[:-1] + turns
    angles = np.cumsum(np.append(study.truss.stowed_angle, steps))
    speeds = np.maximum(speeds, 0.0)  # a bound of the solver leaves a little below
    return Hermite(times, angles, speeds, after, before, gains, turns)


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
        exact = exact_law(jerks, columns["knot_angle"])
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


def exact_law(columns: Mapping[str, Array], angles: Array) -> Piecewise | None:
    """The law of piecewise linear jerk, if the columns of jerks reproduce the angles."""
    after, before = (columns.get(name) for name in JERKS)
    if after is None or before is None or not np.isfinite([after, before]).all():
        return None
    ramps = tuple(zip(after[:-1].tolist(), before[1:].tolist(), strict=True))
    law = linear_jerk(tuple(columns["time"].tolist()), ramps, start_angle=float(angles[0]))
    miss = np.abs(law.motion(columns["time"]).angle - angles).max()
    return law if miss <= EXACT else None
