"""A robust law of the truss from its configuration to its result.

The nominal truss gets its best motion first, to compare with. Then the law of the least worst force
is sought. Both are driven through every scenario, to the worst truss in the ranges of the scatter,
and through trusses that are drawn.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from models.laws import Law
from studies.common.comparison_table import TableRow, costs_elsewhere
from studies.common.console import Console, at_work
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.folder import provenance
from studies.common.rates import Rate, rate
from studies.common.result import Criterion, Result, Series, Verdict
from studies.common.stops import kept_anyway
from studies.margin.schema import MarginRequirements
from studies.robust.config import NOMINAL, RobustTrussStudy, as_dictionary
from studies.robust.ranges import WorstTruss, extremes
from studies.robust.replay import Replay, drawn, replay
from studies.robust.search import RobustLaw, bounds, check, named, search
from studies.truss.checks import criteria, engine_criterion, table_rows
from studies.truss.config import TrussStudy
from studies.truss.config import as_dictionary as truss_dictionary
from studies.truss.limits.tolerances import CAPS, TENSION
from studies.truss.motions.deployment import Deployment, how_to_read
from studies.truss.motions.laws import paper_laws_of
from studies.truss.search.best_law import best_law
from studies.truss.search.from_starts import starts_told
from studies.truss.search.verdict import BOUND_MET
from studies.truss.study import series_of

ROBUST, NOMINAL_LAW = "robust", "nominal optimum"
BY_FACTORS = "nominal optimum, motor by factors"
BAND_COLUMNS = ("time", "low", "high")

__all__ = ["check", "run"]


@dataclass(frozen=True, eq=False)
class _Found:
    """Both laws, in all scenarios and on all draws; the study's corners are those it serves."""

    study: RobustTrussStudy
    robust: RobustLaw
    laws: tuple[Deployment, Deployment]
    scenarios: Mapping[str, Replay]  # of each law, a truss for each scenario
    ranges: Mapping[str, tuple[WorstTruss, WorstTruss]]  # of each law; empty if none are served
    draws: Mapping[str, Replay]
    bounds: Mapping[str, float]

    def worst_of(self, law: str) -> float:
        """Largest force of a law in any scenario, or on any truss in the ranges [N]."""
        peak = float(self.scenarios[law].peak.max())
        return max(peak, self.ranges[law][0].value) if law in self.ranges else peak

    @property
    def worst(self) -> float:
        """The same of the robust law."""
        return self.worst_of(ROBUST)

    @property
    def cap(self) -> float:
        """Force of the motor [N]: the cap, or else the peak force of the robust law."""
        return self.study.deployment.caps.force or self.worst


def run(
    study: RobustTrussStudy,
    console: Console | None = None,
    *,
    kept: FinishedSteps = NOTHING_KEPT,
) -> Result:
    """Find the robust law, and compare it with the nominal optimum.

    Parameters
    ----------
    study : RobustTrussStudy
        What is asked.
    console : Console, optional
        Where lines of progress go: standard error by default. `silent()` shows none.
    kept : FinishedSteps, optional
        Where finished steps go to, and where those of an earlier run are read.

    Returns
    -------
    Result
        Of the kind "robust-truss", with the columns of `studies.truss.motions.deployment`.

    Raises
    ------
    StudyError
        If no law serves all scenarios, or none was found.
    """
    with at_work(console) as told:
        return _answer(study, told, kept)


def _answer(study: RobustTrussStudy, console: Console, kept: FinishedSteps) -> Result:
    deployment = study.deployment
    console.progress("the lower bound of the force in each scenario")
    # now, as who stops the search does not wait for it
    least = kept.step("bounds", lambda: bounds(study, study.scenarios), say=console.progress)
    console.progress(f"{NOMINAL_LAW}: the best motion of the nominal truss, to compare with")
    nominal = replace(deployment, margin=None)
    law = best_law(nominal, console, kept=kept.within(NOMINAL_LAW), accuracy=None)
    own = _moved(NOMINAL_LAW, law, deployment)
    robust = search(study, own, console, kept)

    def result(whole: bool) -> Result:
        return _result(_found(robust, own, least, console, kept, whole))

    return kept_anyway(result, robust.audit.interrupted)


def _moved(name: str, law: Law, study: TrussStudy) -> Deployment:
    """A law on the truss of a study, without its drive."""
    return Deployment(name, law, study.truss, margin=study.margin, opening=study.opening)


def _found(
    robust: RobustLaw,
    own: Deployment,
    least: Mapping[str, float],
    console: Console,
    kept: FinishedSteps,
    whole: bool,
) -> _Found:
    """Both laws on all trusses.

    For the whole result also on the random trusses, and with the bounds of the corners.
    """
    study, deployment = robust.study, robust.study.deployment
    laws = (_moved(ROBUST, robust.law, deployment), own)
    stated = np.array([study.values_of(stated) for stated in study.scenarios.values()])
    scenarios = {law.name: replay(law, stated) for law in laws}
    draws: dict[str, Replay] = {}
    if study.uncertainty.draws and study.uncertainty.scatter and whole:
        console.progress(f"{study.uncertainty.draws} trusses are drawn")
        values = drawn(study)
        for law in laws:
            take = functools.partial(replay, law, values, console.progress)
            draws[law.name] = kept.step(f"draws of {law.name}", take, say=console.progress)
    if whole:
        least = {**least, **bounds(study, [name for name in study.scenarios if name not in least])}
    ranges = {law.name: both for law in laws if (both := extremes(study, law)) is not None}
    return _Found(study, robust, laws, scenarios, ranges, draws, least)


def _result(found: _Found) -> Result:
    study, robust = found.study, found.laws[0]
    bound = max(found.bounds.values())

    # the worst force stands first; the rows of any truss say what the law does to the nominal one
    others = paper_laws_of(study.deployment, robust.law.duration)
    rows = [
        replace(row, minimised=False)
        for row in table_rows(study.deployment, [*found.laws, *others], {})
    ]
    worst = TableRow(
        "worst-force",
        "peak rope force on the worst truss" if found.ranges else "peak rope force, worst scenario",
        "N",
        {name: found.worst_of(name) for name in found.scenarios},
        cap=study.deployment.caps.force,
        bound=bound,
        minimised=True,
        better="less",
    )

    table = (worst, *_scenario_rows(found), *rows)
    return Result(
        kind="robust-truss",
        question=study.question,
        configuration=as_dictionary(study),
        arrays={**series_of(robust), **_bands(found)},
        table=table,
        costs_elsewhere=costs_elsewhere(table, (NOMINAL_LAW,)),
        bounds={"worst-force": bound},
        verdict=_verdict(found, bound),
        checks=(
            *criteria(study.deployment, robust),
            *_limit_checks(found),
            engine_criterion(found.robust.solution),
            *found.robust.second,
        ),
        remarks=tuple(_remarks(found, bound)),
        details=_details(found),
        provenance=provenance(),
    )


def _details(found: _Found) -> dict[str, Any]:
    """What each scenario asks, how often limits are broken, and what the starts came to."""
    study = found.study
    scenarios = {
        name: {
            law: {"peak": float(r.peak[place]), "least": float(r.least[place])}
            for law, r in found.scenarios.items()
        }
        for place, name in enumerate(study.scenarios)
    }

    return {
        "study": truss_dictionary(study.deployment),
        "scenarios": scenarios,
        "corners": study.corners,
        "ranges": {
            law: {"largest force": asdict(largest), "least tension": asdict(least)}
            for law, (largest, least) in found.ranges.items()
        },
        "scenario_bounds": dict(found.bounds),
        "motor_force": found.cap,
        "rates": {
            law: {word: asdict(one) for word, one in rates.items()}
            for law, rates in _rates(found).items()
        },
        "starts": starts_told(found.robust.audit.trials),
        "how_to_read": how_to_read(found.laws[0]),
    }


def _bands(found: _Found) -> dict[str, Series]:
    """Force over time, 5 and 95 % of the draws of each law, along a time of its own."""
    return {
        f"{name}/{column}": Series(
            "s" if column == "time" else "N",
            f"{name}/time",
            getattr(replayed, column),
            "since the start" if column == "time" else f"{column} end of 90 % of the draws' forces",
        )
        for name, replayed in found.draws.items()
        for column in BAND_COLUMNS
    }


def _scenario_rows(found: _Found) -> list[TableRow]:
    """Peak force and least tension of both laws in each scenario."""
    rows = []
    for place, name in enumerate(found.study.scenarios):
        peaks = {law: float(r.peak[place]) for law, r in found.scenarios.items()}
        leasts = {law: float(r.least[place]) for law, r in found.scenarios.items()}
        rows += [
            TableRow(
                f"{name}-peak",
                f"peak rope force, {name}",
                "N",
                peaks,
                bound=found.bounds.get(name),
                better="less",
            ),
            TableRow(f"{name}-least", f"least tension, {name}", "N", leasts, better="more"),
        ]
    return rows


def _limit_checks(found: _Found) -> list[Criterion]:
    """The limits in each scenario, and on the worst truss in the ranges.

    They hold within the tolerances of any motion of the truss.
    """
    caps, replayed = found.study.deployment.caps, found.scenarios[ROBUST]
    rows = zip(found.study.scenarios, replayed.peak.tolist(), replayed.least.tolist(), strict=True)
    places = [(f", {name}", peak, least) for name, peak, least in rows]
    if ROBUST in found.ranges:
        largest, lowest = found.ranges[ROBUST]
        places.append((" in the ranges", largest.value, lowest.value))

    checks = []
    for where, peak, least in places:
        taut, asked = least >= caps.least_tension - TENSION * peak, caps.least_tension
        checks.append(Criterion(f"least tension{where}", "N", least, asked, taut))
        if caps.force is not None:
            within = peak <= caps.force * (1 + CAPS)
            checks.append(Criterion(f"rope force{where}", "N", peak, caps.force, within))
    return checks


def _verdict(found: _Found, bound: float) -> Verdict:
    """Local, unless the bound of one scenario is met."""
    solution, worst = found.robust.solution, found.worst
    if not solution.verification.passed:
        return Verdict("unverified", "; ".join(solution.verification.reasons))
    gap = (worst - bound) / worst
    if gap <= BOUND_MET:
        return Verdict(
            "global",
            f"global: {worst:.6g} N is within {100 * gap:.2g} % of {bound:.6g} N, the lower bound "
            "of the worst scenario",
        )
    solved = sum(trial.error is None for trial in found.robust.audit.trials)
    return Verdict(
        "local",
        f"local: best of {solved} starts; proven lower bound {bound:.6g} N, {100 * gap:.3g} % "
        "below it",
    )


def _motors(found: _Found) -> dict[str, tuple[str, float]]:
    """By name of a rate: the law, and the force of the motor that drives it [N]."""
    motors = {name: (name, found.cap) for name in found.draws}
    if found.draws and isinstance(found.study.deployment.margin, MarginRequirements):
        motors[BY_FACTORS] = (NOMINAL_LAW, found.laws[1].values["peak-factored-force"])
    return motors


def _rates(found: _Found) -> dict[str, dict[str, Rate]]:
    """How often each law breaks each limit on the draws."""
    caps, level = found.study.deployment.caps, found.study.uncertainty.confidence
    rates = {}
    for name, (law, motor) in _motors(found).items():
        replayed = found.draws[law]
        over = replayed.peak > motor * (1 + CAPS)
        slack = replayed.least < caps.least_tension - TENSION * replayed.peak
        rates[name] = {
            word: rate(int(broken.sum()), broken.size, level)
            for word, broken in (("force", over), ("tension", slack), ("any", over | slack))
        }
    return rates


def _remarks(found: _Found, bound: float) -> list[str]:
    study = found.study
    of_nominal, of_robust = found.scenarios[NOMINAL_LAW], found.scenarios[ROBUST]
    place = list(study.scenarios).index(NOMINAL)
    remarks = [
        f"The robust law needs at most {found.worst:.6g} N, {_hardest(found, ROBUST)}; the nominal "
        f"optimum needs {found.worst_of(NOMINAL_LAW):.6g} N, {_hardest(found, NOMINAL_LAW)}.",
        f"On the nominal truss the robust law needs {of_robust.peak[place]:.6g} N, the nominal "
        f"optimum {of_nominal.peak[place]:.6g} N.",
        f"The proven lower bound for all trusses together is {bound:.6g} N, the largest of their "
        "individual bounds.",
        *_on_ranges(found),
    ]
    if isinstance(study.deployment.margin, MarginRequirements):
        needed = found.laws[1].values["peak-factored-force"]
        remarks.append(
            f"A margin by factors requires a motor of {needed:.6g} N for the nominal optimum."
        )
    else:
        remarks.append("No margin by factors is set; --margin aiaa-s-114 adds one.")
    return [*remarks, *_on_rates(found)]


def _hardest(found: _Found, law: str) -> str:
    """The truss on which a law needs its largest force."""
    names = list(found.study.scenarios)
    hardest = found.scenarios[law].peak
    if law in found.ranges and found.ranges[law][0].value > hardest.max() * (1 + CAPS):
        return "at another corner of the ranges"
    return f"in scenario {names[int(hardest.argmax())]}"


def _on_ranges(found: _Found) -> list[str]:
    """The trusses for which the law works, and the corners."""
    study = found.study
    if ROBUST not in found.ranges:
        return ["The law keeps the limits in its scenarios only: random trusses may violate them."]
    ranges = study.uncertainty.ranges
    listed = ", ".join(f"{word} {low:.6g} to {high:.6g}" for word, (low, high) in ranges.items())
    remarks = [
        f"The robust law works for every truss with {listed}: at each instant the force is "
        "monotone in each of these, so its extremes are at corners of the ranges. All corners were "
        "checked."
    ]
    remarks += [f"A scenario was added: {named(study, corner)}." for corner in study.corners]
    remarks += [
        f"On these trusses the {name} law needs at most {largest.value:.6g} N and keeps a tension "
        f"of at least {least.value:.6g} N."
        for name, (largest, least) in found.ranges.items()
    ]
    return remarks


def _on_rates(found: _Found) -> list[str]:
    """How often each law breaks its limits, in words."""
    study, rates = found.study, _rates(found)
    if not rates:
        why = "the study was stopped before"
        if not study.uncertainty.draws:
            why = "robust.draws is 0"
        elif not study.uncertainty.scatter:
            why = "no scatter is given"
        return [f"There are no random trusses: {why}."]
    level, motors = 100 * study.uncertainty.confidence, _motors(found)
    remarks = [
        f"Of {of_law['any'].draws} random trusses, {name}: a limit is violated in "
        f"{of_law['any'].words}; more than {motors[name][1]:.6g} N are needed in "
        f"{of_law['force'].words}; a tension is below its limit in {of_law['tension'].words}."
        for name, of_law in rates.items()
    ]
    return [*remarks, f"In brackets: the {level:g} % confidence interval of the rate."]
