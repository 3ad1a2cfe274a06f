"""A robust law of the truss from its configuration to its result.

The nominal truss gets its best motion first, to compare with. Then the law of the least worst force
is sought. Both are driven through every scenario, and through trusses that are drawn.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from studies.common.console import Console, silent
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series, TableRow, Verdict
from studies.margin.schema import MarginRequirements
from studies.robust.config import NOMINAL, RobustTrussStudy, as_dictionary
from studies.robust.replay import Rate, Replay, drawn, rate, replay
from studies.robust.search import RobustLaw, bounds, check, search
from studies.truss.checks import criteria, engine_criterion, table_rows
from studies.truss.config import as_dictionary as truss_dictionary
from studies.truss.limits.tolerances import CAPS, TENSION
from studies.truss.motions.deployment import Deployment, how_to_read
from studies.truss.motions.laws import paper_laws
from studies.truss.search.best_motion import BestMotion
from studies.truss.search.motion_search import Search
from studies.truss.search.verdict import BOUND_MET
from studies.truss.study import series_of

ROBUST, NOMINAL_LAW = "robust", "nominal optimum"
BAND_COLUMNS = ("time", "low", "high")

__all__ = ["check", "run"]


@dataclass(frozen=True, eq=False)
class _Found:
    """Both laws, in all scenarios and on all draws."""

    study: RobustTrussStudy
    nominal: BestMotion
    robust: RobustLaw
    laws: tuple[Deployment, Deployment]
    scenarios: Mapping[str, Replay]  # of each law, a truss for each scenario
    draws: Mapping[str, Replay]
    bounds: Mapping[str, float]

    @property
    def worst(self) -> float:
        """Largest force of the robust law in any scenario [N]."""
        return float(self.scenarios[ROBUST].peak.max())

    @property
    def cap(self) -> float:
        """Force that the motor has [N]: as stated, else what the robust law needs of it."""
        return self.study.deployment.caps.force or self.worst


def run(study: RobustTrussStudy, console: Console | None = None) -> Result:
    """Find the robust law, and compare it with the nominal optimum.

    Returns
    -------
    Result
        Of the kind "robust-truss", with the columns of `studies.truss.motions.deployment`.

    Raises
    ------
    StudyError
        If no law serves all scenarios, or none was found.
    """
    console = console or silent()
    deployment = study.deployment
    console.progress(f"{NOMINAL_LAW}: the best motion of the nominal truss, to compare with")
    nominal = Search(dataclasses.replace(deployment, margin=None), console).run()
    console.progress(f"robust law: {len(study.scenarios)} scenarios")
    robust = search(study, console)

    laws = (
        Deployment(ROBUST, robust.law, deployment.truss, None, deployment.margin),
        Deployment(NOMINAL_LAW, nominal.deployment.law, deployment.truss, None, deployment.margin),
    )
    stated = np.array([study.values_of(stated) for stated in study.scenarios.values()])
    scenarios = {law.name: replay(law, stated) for law in laws}
    draws = {}
    if study.uncertainty.draws and study.uncertainty.scatter:
        console.progress(f"{study.uncertainty.draws} trusses are drawn")
        values = drawn(study)
        draws = {law.name: replay(law, values, console.progress) for law in laws}
    found = _Found(study, nominal, robust, laws, scenarios, draws, bounds(study))
    return _result(found)


def _result(found: _Found) -> Result:
    study, robust = found.study, found.laws[0]
    bound = max(found.bounds.values())

    # the worst force stands first; the rows of any truss say what the law does to the nominal one
    others = paper_laws(robust.truss, robust.law.duration, None, robust.margin)
    rows = [
        dataclasses.replace(row, minimised=False)
        for row in table_rows(study.deployment, [*found.laws, *others], {})
    ]
    worst = TableRow(
        "worst-force",
        "peak rope force in the worst scenario",
        "N",
        {name: float(replayed.peak.max()) for name, replayed in found.scenarios.items()},
        cap=study.deployment.caps.force,
        bound=bound,
        minimised=True,
        better="less",
    )

    return Result(
        kind="robust-truss",
        question=study.question,
        configuration=as_dictionary(study),
        arrays={**series_of(robust), **_bands(found)},
        table=(worst, *_scenario_rows(found), *rows),
        bounds={"worst-force": bound},
        verdict=_verdict(found, bound),
        checks=(
            *criteria(study.deployment, robust),
            *_scenario_checks(found),
            engine_criterion(found.robust.solution),
        ),
        remarks=tuple(_remarks(found, bound)),
        details=_details(found),
        provenance=provenance(),
        interrupted=found.robust.audit.interrupted or found.nominal.interrupted,
    )


def _details(found: _Found) -> dict[str, Any]:
    """What each scenario asks, how often limits are broken, and what the starts came to."""
    study = found.study
    return {
        "study": truss_dictionary(study.deployment),
        "scenarios": {
            name: {
                law: {"peak": float(r.peak[place]), "least": float(r.least[place])}
                for law, r in found.scenarios.items()
            }
            for place, name in enumerate(study.scenarios)
        },
        "scenario_bounds": dict(found.bounds),
        "motor_force": found.cap,
        "rates": {
            law: {word: dataclasses.asdict(one) for word, one in rates.items()}
            for law, rates in _rates(found).items()
        },
        "starts": [
            {"start": t.name, "value": t.value, "seconds": t.seconds, "failure": t.reason}
            for t in found.robust.audit.trials
        ],
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
                bound=found.bounds[name],
                better="less",
            ),
            TableRow(f"{name}-least", f"least tension, {name}", "N", leasts, better="more"),
        ]
    return rows


def _scenario_checks(found: _Found) -> list[Criterion]:
    """The limits in each scenario, within the tolerances of any motion of the truss."""
    caps, replayed = found.study.deployment.caps, found.scenarios[ROBUST]
    checks = []
    for name, peak, least in zip(found.study.scenarios, replayed.peak, replayed.least, strict=True):
        asked = caps.least_tension or 0.0
        passed = bool(least >= asked - TENSION * peak)
        checks.append(Criterion(f"least tension, {name}", "N", float(least), asked, passed))
        if caps.force is not None:
            kept = bool(peak <= caps.force * (1 + CAPS))
            checks.append(Criterion(f"rope force, {name}", "N", float(peak), caps.force, kept))
    return checks


def _verdict(found: _Found, bound: float) -> Verdict:
    """Local at best, unless the bound of one scenario is met."""
    solution, worst = found.robust.solution, found.worst
    if not solution.verification.passed:
        return Verdict("unverified", "; ".join(solution.verification.reasons))
    gap = (worst - bound) / worst
    if gap <= BOUND_MET:
        return Verdict(
            "global",
            f"global: {worst:.6g} N is within {100 * gap:.2g} % of {bound:.6g} N, which the worst "
            "scenario needs with any law",
        )
    solved = sum(trial.error is None for trial in found.robust.audit.trials)
    return Verdict(
        "local",
        f"local: best of {solved} starts; no law needs less than {bound:.6g} N, which leaves room "
        f"for {100 * gap:.2g} % less",
    )


def _rates(found: _Found) -> dict[str, dict[str, Rate]]:
    """How often each law breaks each limit on the draws."""
    caps, level = found.study.deployment.caps, found.study.uncertainty.confidence
    asked = caps.least_tension or 0.0
    rates = {}
    for name, replayed in found.draws.items():
        over = replayed.peak > found.cap * (1 + CAPS)
        slack = replayed.least < asked - TENSION * replayed.peak
        rates[name] = {
            word: rate(int(broken.sum()), broken.size, level)
            for word, broken in (("force", over), ("tension", slack), ("any", over | slack))
        }
    return rates


def _remarks(found: _Found, bound: float) -> list[str]:
    study, names = found.study, list(found.study.scenarios)
    of_nominal, of_robust = found.scenarios[NOMINAL_LAW], found.scenarios[ROBUST]
    hardest = names[int(of_robust.peak.argmax())]
    place = names.index(NOMINAL)
    remarks = [
        f"The robust law needs at most {found.worst:.6g} N, in scenario {hardest}; the nominal "
        f"optimum needs {of_nominal.peak.max():.6g} N in its worst scenario.",
        f"On the nominal truss the robust law needs {of_robust.peak[place]:.6g} N, the nominal "
        f"optimum {of_nominal.peak[place]:.6g} N.",
        f"No law needs less than {bound:.6g} N in every scenario: the largest of their own bounds.",
    ]
    if isinstance(study.deployment.margin, MarginRequirements):
        needed = found.laws[1].values["peak-factored-force"]
        remarks.append(
            f"A margin by factors asks for a motor of {needed:.6g} N for the nominal optimum."
        )
    else:
        remarks.append("No margin by factors is stated; --margin aiaa-s-114 sets one beside this.")
    rates = _rates(found)
    if not rates:
        return [*remarks, "No scatter is stated, so no trusses were drawn."]

    level = 100 * study.uncertainty.confidence
    whose = "the stated cap" if study.deployment.caps.force else "what the robust law needs"
    for name, of_law in rates.items():
        remarks.append(
            f"Of {of_law['any'].draws} trusses drawn, the {name} law breaks a limit in "
            f"{of_law['any'].words}: more than {found.cap:.6g} N, {whose}, in "
            f"{of_law['force'].words}; a tension below what is asked in {of_law['tension'].words}. "
            f"In brackets: where the true rate lies, with a confidence of {level:g} %."
        )
    return remarks
