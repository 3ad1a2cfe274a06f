"""A co-design from its configuration to its result.

First the given design gets its best motion. The largest force in its bars is the cap for all
designs, unless the study has another cap. Then design and motion are optimised together. The result
is simulated with the truss model and compared with caps and requirements, like any motion.
"""

from __future__ import annotations

import dataclasses
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from models.truss import TrussParameters
from ocp import Solution
from studies.codesign.config import UNITS, CodesignStudy, as_dictionary
from studies.codesign.prices import Price, prices
from studies.codesign.requirements import Requirement, check_some_design, requirements
from studies.codesign.search import ROUGH, STATED, BestDesign, designed, search
from studies.common.comparison_table import TableRow, costs_elsewhere
from studies.common.console import Console, at_work, silent
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series, Verdict
from studies.common.stops import kept_anyway
from studies.truss.bars import bars_of
from studies.truss.checks import (
    criteria,
    engine_criterion,
    restart_in_words,
    table_rows,
    tolerated,
)
from studies.truss.config import TrussStudy
from studies.truss.config import as_dictionary as truss_dictionary
from studies.truss.limits.bounds import lower_bounds
from studies.truss.motions.deployment import COLUMNS, Deployment, how_to_read, profile
from studies.truss.motions.laws import deployment_of, law_of, paper_laws_of
from studies.truss.quantities import OBJECTIVES
from studies.truss.search.best_law import best_law
from studies.truss.search.from_starts import starts_told
from studies.truss.search.proofs import check_some_optimum
from studies.truss.study import series_of

HELD = 1e-6  # relative, as for the caps of a motion
SHOWN = ("angle", "motor_force", "angular_speed")  # of the given design, for the figure


@dataclass(frozen=True, eq=False)
class Codesign:
    """What was found, before it is a result.

    Attributes
    ----------
    study : with the cap on the bars that holds.
    stated : the best motion of the given design.
    held : the requirements.
    found : of all starts.
    deployment : the best motion on the best design.
    prices : of the active bounds, largest first; None if the user stopped before them.
    """

    study: CodesignStudy
    stated: Deployment
    held: Sequence[Requirement]
    found: BestDesign
    deployment: Deployment
    prices: Sequence[Price] | None

    @property
    def solution(self) -> Solution:
        """The best of the starts."""
        return self.found.audit.optima[0].solution

    @property
    def truss(self) -> TrussParameters:
        """The design that was found."""
        return self.deployment.truss

    @property
    def saved(self) -> float:
        """Part of the given design's minimum force that the design saves."""
        key = self.study.objective
        return 1.0 - self.deployment.values[key] / self.stated.values[key]


def check(study: CodesignStudy, console: Console | None = None) -> None:
    """Refuse what no design or no motion meets, before any work.

    Raises
    ------
    StudyError
        With the nearest value that works.
    """
    check_some_design(study, requirements(study))
    check_some_optimum(_without_force_caps(study.deployment), console or silent())


def run(
    study: CodesignStudy, console: Console | None = None, *, kept: FinishedSteps = NOTHING_KEPT
) -> Result:
    """Find the design and the motion of the least force, and verify them.

    Parameters
    ----------
    study : CodesignStudy
        What is asked.
    console : Console, optional
        Where lines of progress go: standard error by default. `silent()` shows none.
    kept : FinishedSteps, optional
        Where finished steps go to, and where those of an earlier run are read.

    Returns
    -------
    Result
        Of the kind "codesign", with the columns of `studies.truss.motions.deployment` as arrays.

    Raises
    ------
    StudyError
        If no design meets the requirements, or none was found.
    """
    with at_work(console) as told:
        return _answer(study, told, kept)


def _answer(study: CodesignStudy, console: Console, kept: FinishedSteps) -> Result:
    begin, solver = clock.monotonic(), study.deployment.solver
    console.progress(f"{STATED}: its own best motion, for comparison")
    half = dataclasses.replace(solver, seconds=solver.seconds / 2)  # the other is the design's
    alone = dataclasses.replace(_without_force_caps(study.deployment), solver=half)
    law = best_law(alone, console, kept=kept.within(STATED), accuracy=None)
    stated = deployment_of(STATED, law, alone)
    study = _with_bars(study, stated)
    held = requirements(study)
    check_some_design(study, held)

    left = max(solver.seconds - (clock.monotonic() - begin), solver.seconds / 4)
    found = search(study, held, left, console, kept)
    solution = found.audit.optima[0].solution
    deployment = study.deployment
    better = designed(deployment, found.design)
    law = law_of(better, found.statement, solution)
    best = deployment_of("optimal", law, better)

    def result(whole: bool) -> Result:
        if whole:
            console.progress("shadow prices of the active bounds")
        pressing = prices(study, held, found.design, solution) if whole else None
        return _result(Codesign(study, stated, held, found, best, pressing))

    return kept_anyway(result, found.audit.interrupted)


def _without_force_caps(study: TrussStudy) -> TrussStudy:
    """The study of the given design, which need not meet caps that another design is to meet."""
    return dataclasses.replace(
        study, caps=dataclasses.replace(study.caps, force=None, bar_force=None)
    )


def _with_bars(study: CodesignStudy, stated: Deployment) -> CodesignStudy:
    """The study with a cap on the bars: as given, or the force that the given design needs."""
    deployment = study.deployment
    if deployment.caps.bar_force is not None:
        return study
    caps = dataclasses.replace(deployment.caps, bar_force=stated.values["peak-bar-force"])
    return dataclasses.replace(study, deployment=dataclasses.replace(deployment, caps=caps))


def _result(made: Codesign) -> Result:
    study, best = made.study, made.deployment
    better = designed(study.deployment, made.found.design)
    before = made.stated
    laws = [best, before, *paper_laws_of(better, best.law.duration)]
    table = (*_design_rows(made), *table_rows(better, laws, {}))
    audit, bars = made.found.audit, bars_of(best, study.deployment.caps)

    return Result(
        kind="codesign",
        question=study.question,
        configuration=as_dictionary(study),
        arrays={**series_of(best), **_stated_series(before)},
        table=table,
        verdict=_verdict(made),
        checks=(
            *criteria(better, best),
            *bars.checks,
            *_requirement_checks(made),
            engine_criterion(made.solution),
            *made.found.second,
        ),
        costs_elsewhere=costs_elsewhere(table),
        remarks=(
            *_remarks(made),
            *tolerated(better, best),
            *bars.sentences,
            *restart_in_words(best),
        ),
        details={
            "study": truss_dictionary(better),
            "design": dict(made.found.design),
            "prices": [dataclasses.asdict(price) for price in made.prices or ()],
            "starts": starts_told(audit.trials),
            "how_to_read": how_to_read(best),
        },
        provenance=provenance(),
    )


def _stated_series(before: Deployment) -> dict[str, Series]:
    """The motion of the given design along a time of its own."""
    rows, axis = profile(before), f"{STATED}/time"
    return {
        f"{STATED}/{name}": Series(COLUMNS[name][0], axis, rows[name], COLUMNS[name][1])
        for name in ("time", *SHOWN)
    }


def _design_rows(made: Codesign) -> list[TableRow]:
    """The free parameters and the requirements, of both designs."""
    both = {"optimal": made.truss, STATED: made.study.deployment.truss}

    def row(key: str, title: str, unit: str, number: Callable[[TrussParameters], Any]) -> TableRow:
        values = {name: float(number(truss)) for name, truss in both.items()}
        return TableRow(key, title, unit, values)

    rows = [
        row(name, name.replace("_", " "), UNITS[name], attrgetter(name))
        for name in made.found.design
    ]
    for one in made.held:
        if not one.at_rest:  # what the caps imply at rest is no requirement of its own
            held = row(one.title.replace(" ", "-"), one.title, one.unit, one.expression)
            rows.append(dataclasses.replace(held, cap=one.limit))
    return rows


def _requirement_checks(made: Codesign) -> list[Criterion]:
    return [
        Criterion(
            one.title,
            one.unit,
            float(one.expression(made.truss)),
            one.limit,
            bool(float(one.slack(made.truss)) >= -HELD),
        )
        for one in made.held
        if not one.at_rest
    ]


def _verdict(made: Codesign) -> Verdict:
    """Local: the starts found it, and there is no proof that no other design is better."""
    audit, unit = made.found.audit, OBJECTIVES[made.study.objective].unit
    if not made.solution.verification.passed:
        return Verdict("unverified", "; ".join(made.solution.verification.reasons))
    solved = sum(trial.error is None for trial in audit.trials)
    listed = "; ".join(
        f"{optimum.value:.6g} {unit} from {' and '.join(optimum.starts)}"
        for optimum in audit.optima
    )
    optima = len(audit.optima)
    return Verdict(
        "local",
        f"local: best of {solved} starts; {optima} optim{'um' if optima == 1 else 'a'} found: "
        f"{listed}",
    )


def _remarks(made: Codesign) -> list[str]:
    key, free = made.study.objective, len(made.found.design)
    title, unit = OBJECTIVES[key].title, OBJECTIVES[key].unit
    before, after = made.stated.values[key], made.deployment.values[key]
    remarks = [
        f"The {title} falls from {before:.6g} to {after:.6g} {unit}, by {100 * made.saved:.3g} %: "
        "each design has its own best motion."
    ]
    bound = lower_bounds(designed(made.study.deployment, made.found.design), None).get(key)
    if bound is not None:
        room = 100 * (1 - bound / after)
        remarks.append(
            f"The proven lower bound for this design is {bound:.6g} {unit}, {room:.2g} % below the "
            "result."
        )

    remarks.append(_on_bounds(made.prices, free))
    if not made.found.exact:
        remarks.append(
            f"The search ended before the best start was solved to full accuracy: its {title} is "
            f"within about {ROUGH:g} of the minimum (relative)."
        )
    return [*remarks, *(price.sentence for price in made.prices or ())]


def _on_bounds(prices: Sequence[Price] | None, free: int) -> str:
    """How many bounds of the design are active, compared with its free parameters."""
    if prices is None:
        return "The study was stopped before the shadow prices of its bounds were found."
    binding = [price for price in prices if price.of_the_design]
    if len(binding) >= free:
        return (
            f"Active bounds determine this design: {len(binding)} bounds fix all {free} free "
            "parameters. To improve it, change a bound; the shadow prices show which."
        )
    if binding:
        return (
            f"{len(binding)} bounds on {free} free parameters are active; the other parameters are "
            "optimal inside their ranges."
        )
    return "No bound of the design is active: it is optimal inside its ranges."
