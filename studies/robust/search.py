"""The law of the least worst force, and which scenario prevents one where none is found."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NoReturn

from models.laws import Law
from ocp import Audit, Interrupted, OcpError, Problem, Settings, Solution, audit
from studies.common.console import Console, number, silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.robust.config import NOMINAL, RobustTrussStudy
from studies.robust.kernel import pull_of
from studies.truss.config import TrussStudy
from studies.truss.motions.laws import law_of
from studies.truss.motions.starts import starting_motion
from studies.truss.problem import Statement, settings_of, state
from studies.truss.search.motion_search import Search
from studies.truss.search.smoothness import first_price

SAME = 1e-4  # relative: optima closer than this are one
WEIGHTS = {"peak-force": 1.0}


class NoLawError(Exception):
    """What the solver ended with failed its verification, and so is no law."""


@dataclass(frozen=True, eq=False)
class RobustLaw:
    """What the starts came to.

    Attributes
    ----------
    audit : of all starts.
    solution : the best of them.
    law : its motion.
    """

    audit: Audit
    solution: Solution
    law: Law


def check(study: RobustTrussStudy) -> None:
    """Refuse scenarios that have no motion even alone, before any work.

    Raises
    ------
    StudyError
        Naming the scenario, with the nearest value that works.
    """
    for name in study.scenarios:
        try:
            Search(alone(study, name), silent()).check()
        except StudyError as error:
            raise StudyError(f"scenario {name}: {error}", error.exit_code) from error


def alone(study: RobustTrussStudy, scenario: str) -> TrussStudy:
    """The study of one scenario's truss, without what sticks."""
    return dataclasses.replace(study.deployment, truss=study.truss_of(scenario))


def bounds(study: RobustTrussStudy) -> dict[str, float]:
    """What no law beats in each scenario [N]; a joint that sticks only adds to it."""
    return {
        name: Search(alone(study, name), silent()).bounds["peak-force"] for name in study.scenarios
    }


def search(study: RobustTrussStudy, console: Console) -> RobustLaw:
    """Solve from all starts.

    Raises
    ------
    StudyError
        If no start gave a law; it names the scenario that has none alone, if there is one.
    """
    try:
        return _from_all_starts(study, tuple(study.scenarios), console)
    except Interrupted as stop:
        raise StudyError("interrupted before a law was found", ExitCode.INTERRUPTED) from stop
    except (OcpError, NoLawError) as error:
        console.progress("no common law was found; each scenario alone, to see which prevents it")
        raise StudyError(
            f"no law was found that serves all scenarios: {_who_prevents(study)}; the solver says: "
            f"{error}",
            ExitCode.NOT_SOLVED,
        ) from error


def _who_prevents(study: RobustTrussStudy) -> str:
    """Which scenarios have no law alone, in words."""
    without = []
    for name in study.scenarios:
        try:
            _from_all_starts(study, (name,), silent())
        except (OcpError, NoLawError):
            without.append(name)
    if without:
        return f"none was found for {' and '.join(without)} alone either; ease it or its caps"
    return "each has one alone, so they contradict each other; ease a cap or leave a scenario out"


def _from_all_starts(
    study: RobustTrussStudy, scenarios: Sequence[str], console: Console
) -> RobustLaw:
    statements: dict[Problem, Statement] = {}
    deployment = study.deployment

    def stated(start: str) -> Problem:
        statement = _statement(study, scenarios, start)
        problem = statement.problem()
        statements[problem] = statement
        return problem

    laws = [law for law in deployment.solver.starts if law != "phase-plane"]
    if not laws:
        raise StudyError("solver.starts has no law but phase-plane, that of one truss; add bezier")
    found = audit(
        starts={law: functools.partial(stated, law) for law in laws},
        settings=_settings(deployment, len(laws)),
        value=lambda problem, solution: solution.value(
            statements[problem].stages[0], replayed=True
        ),
        same=SAME,
        processes=1,
        failures=(StudyError,),
        seconds=deployment.solver.seconds,
        progress=console.live,
        finished=lambda trial: console.progress(
            f"{trial.name}: failed, {trial.error}"
            if trial.solution is None
            else f"{trial.name}: worst force {number(trial.value, 7)} N, {trial.seconds:.1f} s"
        ),
    )
    best = found.optima[0].solution
    if not (found.interrupted or best.verification.passed):
        raise NoLawError("; ".join(best.verification.reasons))
    return RobustLaw(found, best, law_of(deployment, statements[best.problem], best))


def _settings(study: TrussStudy, starts: int) -> Settings:
    settings = settings_of(study, with_forces=True)
    return dataclasses.replace(settings, seconds=max(study.solver.seconds / starts, 60.0))


def _statement(study: RobustTrussStudy, scenarios: Sequence[str], start: str) -> Statement:
    deployment = study.deployment
    stated: Mapping[str, Mapping[str, float]] = study.scenarios
    pull = pull_of(deployment.truss, [study.values_of(stated[name]) for name in scenarios])
    price = first_price(deployment, 0, WEIGHTS, with_forces=True)
    guess = starting_motion(start, deployment, _no_phase_plane)
    return state(deployment, guess, WEIGHTS, with_forces=True, price=price, pull=pull)


def _no_phase_plane() -> NoReturn:
    raise StudyError(f"the phase plane is that of the {NOMINAL} truss alone, and no start here")
