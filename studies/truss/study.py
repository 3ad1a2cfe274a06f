"""A study of the truss from its configuration to its result.

Whatever a law comes from, it is evaluated between its points, driven through the truss model, and
held against the end conditions (45), the caps and the energy balance: independent of how it was
found.
"""

from __future__ import annotations

import dataclasses
from typing import Any

from studies.common.comparison_table import costs_elsewhere
from studies.common.console import Console, at_work
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.folder import provenance
from studies.common.result import Result, Series
from studies.common.stops import kept_anyway
from studies.truss.bars import bars_of
from studies.truss.checks import (
    arm_in_words,
    criteria,
    engine_criterion,
    restart_in_words,
    start_in_words,
    table_rows,
    tolerated,
)
from studies.truss.config import TrussStudy, as_dictionary
from studies.truss.limits.bounds import lower_bounds
from studies.truss.margins import margins_of
from studies.truss.motions.deployment import COLUMNS, Deployment, how_to_read, profile
from studies.truss.motions.laws import knots, law_of_result, paper_laws_of
from studies.truss.quantities import QUANTITIES
from studies.truss.rope import rope_of
from studies.truss.search.best_motion import BestMotion
from studies.truss.search.from_starts import starts_told
from studies.truss.search.motion_search import best_motion
from studies.truss.search.proofs import PhasePlanes, check_some_optimum
from studies.truss.search.question import Question

_AT_THE_SHORTEST = 1e-6  # of the range of durations: a least time so close to its end is that end
KNOTS = {
    "knot": ("s", "time at which two pieces of the law meet"),
    "knot_angle": ("rad", "deployment angle there"),
    "knot_jerk": ("rad/s^3", "jerk after it"),
    "knot_jerk_before": ("rad/s^3", "jerk before it"),
}


def run(
    study: TrussStudy,
    console: Console | None = None,
    neighbour: Result | None = None,
    *,
    checked: PhasePlanes | None = None,
    kept: FinishedSteps = NOTHING_KEPT,
) -> Result:
    """Find the optimal deployment, compare it with the paper's laws, and verify it.

    Parameters
    ----------
    study : TrussStudy
        What is asked.
    console : Console, optional
        Where lines of progress go: standard error by default. `silent()` shows none.
    neighbour : Result, optional
        Of a like study: its motion is the first to start from, before the laws of this study.
    checked : PhasePlanes, optional
        As `check_some_optimum` gives it, so that nothing is looked into twice.
    kept : FinishedSteps, optional
        Where finished steps go to, and come from.

    Returns
    -------
    Result
        Of the kind "truss", with the columns of `studies.truss.motions.deployment` as arrays.

    Raises
    ------
    StudyError
        If no motion meets the caps, none of those that do is best, or none was found.
    """
    with at_work(console) as told:
        question = Question(
            study,
            told,
            checked=check_some_optimum(study, told) if checked is None else checked,
            neighbour=None if neighbour is None else law_of_result(neighbour),
            confirms=True,
            kept=kept,
        )
        return result_of(study, best_motion(question))


def result_of(study: TrussStudy, best: BestMotion) -> Result:
    """The result that the best motion of a search gives."""
    return kept_anyway(lambda whole: _result(study, best), best.interrupted)


def _result(study: TrussStudy, best: BestMotion) -> Result:
    duration = best.deployment.law.duration
    laws = [best.deployment, *paper_laws_of(study, duration)]
    bounds, remarks = _bounds_of_the_table(study, best)
    table = table_rows(study, laws, bounds)

    # a peak that is only limited by its concession has no value of its own in the solver
    problem = best.solution.problem
    minimised = set(problem.objective_symbols)
    tight = {peak.name for peak in problem.peaks if peak in minimised}
    peaks = [
        f"{name}: {epigraph:.9g} in the solver, {dense:.9g} in the replay, between the points too"
        for name, epigraph, dense in _peaks_found(best)
        if name in tight
    ]
    margins, bars = margins_of(best.deployment), bars_of(best.deployment, study.caps)
    rope = rope_of(best.deployment)
    return Result(
        kind="truss",
        question=study.question,
        configuration=as_dictionary(study),
        arrays={**series_of(best.deployment), **margins.arrays},
        table=table,
        bounds=bounds,
        verdict=best.verdict,
        checks=(
            *criteria(study, best.deployment),
            *bars.checks,
            *rope.checks,
            *margins.checks,
            engine_criterion(best.solution),
            *best.second,
        ),
        costs_elsewhere=costs_elsewhere(table),
        remarks=(
            *margins.sentences,
            *best.remarks,
            *bars.sentences,
            *start_in_words(study),
            *restart_in_words(best.deployment),
            *arm_in_words(best.deployment),
            *rope.sentences,
            *tolerated(study, best.deployment),
            *remarks,
            *_at_the_shortest(study, duration),
            *peaks,
        ),
        details={**_details(best), **margins.details, **rope.details},
        provenance=provenance(),
    )


def _bounds_of_the_table(
    study: TrussStudy, best: BestMotion
) -> tuple[dict[str, float], tuple[str, ...]]:
    """Bounds by quantity, and what to say of them.

    Where the duration is free, a bound for the longest one says little of a row that is not
    minimised: that of the duration that was found stands there.
    """
    if study.fixed_duration is not None:
        return dict(best.bounds), ()
    duration = best.deployment.law.duration
    bounds = lower_bounds(study, None, longest=duration)
    minimised = {name: best.bounds[name] for name in study.objectives if name in best.bounds}
    return {**bounds, "time": best.bounds["time"], **minimised}, (
        f"The bounds of all rows but the minimised one apply to motions of up to {duration:.6g} s.",
    )


def _at_the_shortest(study: TrussStudy, duration: float) -> tuple[str, ...]:
    """What to say of a least time that is the shortest stated one."""
    shortest, longest = study.duration
    alone = [set(objective) for objective in study.minimise] == [{"time"}]
    if not alone or duration > shortest + _AT_THE_SHORTEST * (longest - shortest):
        return ()
    return (
        f"The minimum time is the lower limit of the duration, {shortest:g} s: no cap is active. "
        "Many motions have this duration, and this is an arbitrary one of them. Give a smaller "
        'lower limit, caps, or a further objective, as in minimise = ["time", "peak-force"].',
    )


def series_of(deployment: Deployment) -> dict[str, Series]:
    """The profile, and the knots from which the law itself can be made again."""
    units = COLUMNS | KNOTS
    columns = {name: ("time", values) for name, values in profile(deployment).items()}
    columns |= {name: ("knot", values) for name, values in knots(deployment.law).items()}
    return {
        name: Series(unit=units[name][0], axis=axis, values=values, meaning=units[name][1])
        for name, (axis, values) in columns.items()
    }


def _peaks_found(best: BestMotion) -> tuple[tuple[str, float, float], ...]:
    """Name of each peak, its value in the solver, and in the replay between the points too.

    With an arm the replay is that of the table. The engine's has one polynomial in each interval
    of the mesh, and fast modes of the arm swing several times there.
    """
    found = best.solution.verification.peaks
    if best.deployment.arm is None:
        return found
    known = {QUANTITIES[key].title: value for key, value in best.deployment.values.items()}
    return tuple((name, epigraph, known.get(name, dense)) for name, epigraph, dense in found)


def _details(best: BestMotion) -> dict[str, Any]:
    """What the search went through, and how accurate its answer is."""
    solution, verification = best.solution, best.solution.verification
    peaks = {
        name: {"solver": epigraph, "replayed_between_points": dense}
        for name, epigraph, dense in _peaks_found(best)
    }

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
        "how_to_read": how_to_read(best.deployment),
        "starts": starts_told(best.trials),
        "basins": [dataclasses.asdict(basin) for basin in best.basins],
    }
