"""A study of the truss from its configuration to its result.

Whatever a law comes from, it is evaluated between its points, driven through the truss model, and
held against the end conditions (45), the caps and the energy balance: independent of how it was
found.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ocp import Solution
from studies.common.console import Console, silent
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series, TableRow, costs_elsewhere
from studies.truss.config import DEPLOYED, TrussStudy, as_dictionary
from studies.truss.deployment import COLUMNS, Deployment, profile
from studies.truss.laws import knots, paper_laws
from studies.truss.quantities import QUANTITIES
from studies.truss.search import BestMotion, Search

CAP_TOLERANCE = 1e-6  # relative; what an optimiser that rides a cap leaves
ANGLE_MISS = 1e-8  # [rad] of a computed law at the end
REST = 1e-6  # of the peak speed or acceleration: what counts as none at an end
LONGER = 1e-9  # relative: what a solver may add to the longest duration
IMBALANCE = 1e-8  # of the motor's work: far above the quadrature's own error of 1e-14

KNOTS = {
    "knot": ("s", "time at which two pieces of the law meet"),
    "knot_angle": ("rad", "deployment angle there"),
    "knot_jerk": ("rad/s^3", "jerk behind it"),
    "knot_jerk_before": ("rad/s^3", "jerk before it"),
}

# of the table, in an order that reads well; a quantity that is not listed comes last
_ORDER = (
    "time",
    "peak-speed",
    "peak-acceleration",
    "peak-jerk",
    "peak-rope-acceleration",
    "peak-force",
    "least-tension",
    "peak-power",
    "energy",
    "peak-reaction",
)
ROWS = tuple(dict.fromkeys((*_ORDER, *QUANTITIES)))


def run(study: TrussStudy, console: Console | None = None) -> Result:
    """Find the optimal deployment, compare it with the paper's laws, and verify it.

    Parameters
    ----------
    study : TrussStudy
        What is asked.
    console : Console, optional
        Where lines of progress go; nowhere by default.

    Returns
    -------
    Result
        Of the kind "truss", with the profile of `studies.truss.deployment.COLUMNS` as arrays.

    Raises
    ------
    StudyError
        If no motion meets the caps, none of those that do is best, or none was found.
    """
    search = Search(study, console or silent())
    search.check()
    return result_of(study, search.run())


def result_of(study: TrussStudy, best: BestMotion) -> Result:
    """The result that the best motion of a search gives."""
    laws = [best.deployment, *paper_laws(study.truss, best.deployment.law.duration)]
    table = table_rows(study, laws, best.bounds)

    verification = best.solution.verification
    peaks = [
        f"{name}: {epigraph:.9g} in the solver, {dense:.9g} replayed between points"
        for name, epigraph, dense in verification.peaks
    ]
    return Result(
        kind="truss",
        question=study.question,
        configuration=as_dictionary(study),
        arrays=_series(best.deployment),
        table=table,
        bounds=best.bounds,
        verdict=best.verdict,
        checks=(*criteria(study, best.deployment), _engine_criterion(best.solution)),
        costs_elsewhere=costs_elsewhere(table),
        remarks=(*best.remarks, *peaks),
        details=_details(best),
        provenance=provenance(),
        interrupted=best.interrupted,
    )


def _series(deployment: Deployment) -> dict[str, Series]:
    """The profile, and the knots from which the law itself can be made again."""
    units = COLUMNS | KNOTS
    columns = {name: ("time", values) for name, values in profile(deployment).items()}
    columns |= {name: ("knot", values) for name, values in knots(deployment.law).items()}
    return {
        name: Series(unit=units[name][0], axis=axis, values=values, meaning=units[name][1])
        for name, (axis, values) in columns.items()
    }


def _details(best: BestMotion) -> dict[str, Any]:
    """What the search went through, and how accurate its answer is."""
    solution, verification = best.solution, best.solution.verification
    peaks = {
        name: {"solver": epigraph, "replayed_between_points": dense}
        for name, epigraph, dense in verification.peaks
    }

    starts = [
        {
            "start": trial.name,
            "value": trial.value,
            "seconds": trial.seconds,
            "failure": None if trial.error is None else str(trial.error),
        }
        for trial in best.trials
    ]

    return {
        "accuracy": {
            "solver_objective": verification.objective,
            "replayed_objective": verification.replayed_objective,
            "peaks": peaks,
            "replay_miss_relative": verification.miss,
            "energy_imbalance_relative": best.deployment.energies.imbalance,
        },
        "engine": {
            "passed": verification.passed,
            "reasons": verification.reasons,
            "replay_miss_relative": verification.miss,
            "excess_relative": verification.excess,
            "peaks": [{"name": name, **values} for name, values in peaks.items()],
            "rounds": [dataclasses.asdict(entry) for entry in solution.mesh_iterations],
        },
        "starts": starts,
        "basins": [dataclasses.asdict(basin) for basin in best.basins],
    }


def table_rows(
    study: TrussStudy, laws: Sequence[Deployment], bounds: Mapping[str, float]
) -> tuple[TableRow, ...]:
    """All quantities of the laws, with caps and bounds."""
    broken = {deployment.name: broken_caps(study, deployment.values) for deployment in laws}

    return tuple(
        TableRow(
            key=key,
            title=QUANTITIES[key].title,
            unit=QUANTITIES[key].unit,
            values={deployment.name: deployment.values[key] for deployment in laws},
            cap=cap_of(study, key),
            bound=bounds.get(key),
            minimised=key in study.objectives,
            better=QUANTITIES[key].better,
            broken_by=tuple(name for name, excess in broken.items() if key in excess),
        )
        for key in ROWS
    )


def cap_of(study: TrussStudy, key: str) -> float | None:
    """The cap that the quantity `key` has to keep, if there is one."""
    caps = {
        "peak-speed": study.caps.speed,
        "peak-acceleration": study.caps.acceleration,
        "peak-jerk": study.caps.jerk,
        "peak-force": study.caps.force,
        "least-tension": study.caps.least_tension,
    }
    return caps.get(key)


def broken_caps(study: TrussStudy, values: Mapping[str, float]) -> dict[str, float]:
    """Caps that these values break, and by how much, relative."""
    broken = {}
    for key in ROWS:
        cap, value = cap_of(study, key), values[key]
        if cap is None or math.isnan(value):
            continue
        # a tension is a small share of the motor's force, and accurate to a share of it
        size = values["peak-force"] if key == "least-tension" else cap
        excess = (cap - value if key == "least-tension" else value - cap) / size
        if excess > CAP_TOLERANCE:
            broken[key] = excess
    return broken


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
        _at_most("energy imbalance", "1", deployment.energies.imbalance, IMBALANCE),
    )


def _at_most(name: str, unit: str, value: float, limit: float) -> Criterion:
    return Criterion(name, unit, float(value), float(limit), bool(value <= limit))


def _at_the_ends(study: TrussStudy, deployment: Deployment, angle_miss: float) -> list[Criterion]:
    """From rest to rest, between the right angles, in time."""
    duration = deployment.law.duration
    ends = deployment.law.motion(np.array([0.0, duration]))
    misses = np.abs(ends.angle - np.array([study.truss.stowed_angle, DEPLOYED]))
    low, high = study.duration
    rest = REST * deployment.values["peak-speed"]

    held = [
        _at_most("miss of the stowed angle", "rad", misses[0], angle_miss),
        _at_most("miss of the deployed angle", "rad", misses[1], angle_miss),
        _at_most("speed at the ends", "rad/s", np.abs(ends.speed).max(), rest),
        _at_most("duration", "s", duration, high * (1 + LONGER)),
    ]
    if duration < low * (1 - LONGER):
        held.append(Criterion("duration (least)", "s", duration, low, False))
    if study.caps.jerk is not None:  # without a cap on jerk, zero acceleration means nothing
        still = REST * deployment.values["peak-acceleration"]
        worst = np.abs(ends.acceleration).max()
        held.append(_at_most("acceleration at the ends", "rad/s^2", worst, still))
    return held


def _under_the_caps(study: TrussStudy, deployment: Deployment) -> list[Criterion]:
    values = deployment.values

    broken = broken_caps(study, values)
    return [
        Criterion(
            name=quantity.title,
            unit=quantity.unit,
            value=values[key],
            limit=cap,
            passed=key not in broken,
        )
        for key, quantity in QUANTITIES.items()
        if (cap := cap_of(study, key)) is not None
    ]


def _engine_criterion(solution: Solution) -> Criterion:
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
