"""The law with the minimum worst force, and the scenario that prevents a law if none is found.

If the law also has to work for ranges, it is first computed for the scenarios. A corner of the
ranges at which it is worse becomes a scenario, until there is none: few of the many corners decide.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from models.laws import Law
from ocp import (
    Audit,
    Interrupted,
    OcpError,
    Problem,
    Relaxed,
    Solution,
    relaxed,
)
from studies.common.code_version import hashed
from studies.common.console import Console, silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.result import Criterion
from studies.common.second_solve import second_solve
from studies.robust.config import RobustTrussStudy
from studies.robust.kernel import pull_of
from studies.robust.ranges import with_corners
from studies.robust.replay import replay
from studies.truss.config import TrussStudy
from studies.truss.limits.tolerances import CAPS
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import law_of, pinned_bezier
from studies.truss.motions.starts import starting_laws, starting_motion
from studies.truss.problem import ROPE_FORCE, Statement, bound_names, settings_of, state
from studies.truss.quantities import QUANTITIES
from studies.truss.search.from_starts import Statements, from_starts, one_line
from studies.truss.search.proofs import PhasePlanes, check_some_optimum, proven_bounds
from studies.truss.search.relaxation import RELAXED
from studies.truss.search.smoothness import first_price

SAME = 1e-4  # relative: optima closer than this are one
WEIGHTS = {"peak-force": 1.0}
ROUNDS = 6  # of further corners; each law that was tried took one or two


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
    study : with the corners that it serves as scenarios.
    statement : of the best of the starts.
    second : what a second solve says of it, where the user did not stop before.
    """

    audit: Audit
    solution: Solution
    law: Law
    study: RobustTrussStudy
    statement: Statement
    second: tuple[Criterion, ...] = ()


def check(study: RobustTrussStudy, console: Console | None = None) -> None:
    """Refuse scenarios that have no motion even alone, before any work.

    Raises
    ------
    StudyError
        Naming the scenario, with the nearest value that works.
    """
    # the corners of any law will do to find one that has none
    duration = study.deployment.fixed_duration
    assert duration is not None
    truss = study.deployment.truss
    law = pinned_bezier(truss, duration, study.deployment.opening)
    study = with_corners(study, Deployment("Bezier", law, truss))
    for name in study.scenarios:
        try:
            check_some_optimum(alone(study, name), console or silent())
        except StudyError as error:
            raise StudyError(f"scenario {named(study, name)}: {error}", error.exit_code) from error


def named(study: RobustTrussStudy, scenario: str) -> str:
    """A scenario in words; for a corner of the ranges, its values."""
    if scenario not in study.corners:
        return scenario
    values = ", ".join(f"{word} {value:.6g}" for word, value in study.corners[scenario].items())
    return f"{scenario} of the ranges ({values})"


def alone(study: RobustTrussStudy, scenario: str) -> TrussStudy:
    """The study of one scenario's truss, without what sticks."""
    return dataclasses.replace(study.deployment, truss=study.truss_of(scenario))


def bounds(study: RobustTrussStudy, scenarios: Iterable[str]) -> dict[str, float]:
    """What no law beats in each of some scenarios [N]; a joint that sticks only adds to it.

    Raises
    ------
    KeyboardInterrupt
        If the user stops it.
    """
    found = {}
    for name in scenarios:
        proven = proven_bounds(PhasePlanes(alone(study, name), silent().progress))
        if proven.interrupted:
            raise KeyboardInterrupt
        found[name] = proven.values["peak-force"]
    return found


def search(
    study: RobustTrussStudy,
    nominal: Deployment,
    console: Console,
    kept: FinishedSteps = NOTHING_KEPT,
) -> RobustLaw:
    """Solve from all starts, for the scenarios and for as many corners as it takes.

    Parameters
    ----------
    nominal : the nominal truss's own law, whose worst corners are served from the beginning.
    kept : where finished steps go to, and where those of an earlier run are read.

    Raises
    ------
    StudyError
        If no start gave a law; it says which limit of which scenario would have to give way.
    """
    study, found = with_corners(study, nominal), None
    try:
        for _ in range(ROUNDS):
            console.progress(f"robust law: {len(study.scenarios)} scenarios")
            found = _for_scenarios(study, console, kept)
            more = with_corners(study, Deployment("robust", found.law, study.deployment.truss))
            if more is study or found.audit.interrupted:
                break
            study = more
    except (KeyboardInterrupt, StudyError) as stop:
        stopped = isinstance(stop, KeyboardInterrupt) or stop.exit_code is ExitCode.INTERRUPTED
        if found is None or not stopped:
            raise
        # the law of the corners until then: its checks say what it does at the others
        audited = dataclasses.replace(found.audit, interrupted=True)
        return dataclasses.replace(found, audit=audited)
    assert found is not None
    return found if found.audit.interrupted else _a_second_time(found, console, kept)


def _a_second_time(found: RobustLaw, console: Console, kept: FinishedSteps) -> RobustLaw:
    """The law that a second solve leaves, with what it says of it."""
    settings = settings_of(found.study.deployment, with_forces=True)
    second = second_solve(found.solution, settings, console, kept=kept)
    return dataclasses.replace(
        found,
        audit=dataclasses.replace(found.audit, interrupted=second.interrupted),
        solution=second.solution,
        law=law_of(found.study.deployment, found.statement, second.solution),
        second=(second.check,),
    )


def _for_scenarios(study: RobustTrussStudy, console: Console, kept: FinishedSteps) -> RobustLaw:
    try:
        found = _from_all_starts(study, console, kept)
    except Interrupted as stop:
        raise StudyError("interrupted before a law was found", ExitCode.INTERRUPTED) from stop
    except (OcpError, NoLawError) as error:
        console.progress("no common law was found: searching for the smallest relaxation")
        prevents = who_gives_way(study, console) or "the relaxed problem was not solved either"
        raise StudyError(
            f"no law was found for all scenarios: {prevents}; the solver says: {error}",
            ExitCode.NOT_SOLVED,
        ) from error
    _check_force(study, found)
    return found


def _check_force(study: RobustTrussStudy, found: RobustLaw) -> None:
    """Refuse a law that needs more than the cap, with the best force found."""
    cap = study.deployment.caps.force
    law = Deployment("robust", found.law, study.deployment.truss)
    peaks = replay(law, np.array([study.values_of(s) for s in study.scenarios.values()])).peak
    if cap is None or peaks.max() <= cap * (1 + CAPS):
        return
    # others may use what the worst ones leave them, and would do with less
    worst = [
        named(study, name)
        for name, peak in zip(study.scenarios, peaks, strict=True)
        if peak >= peaks.max() * (1 - SAME)
    ]
    raise StudyError(
        f"no law was found that needs at most {cap:.6g} N in all scenarios: the best law found "
        f"(local) needs {peaks.max():.6g} N in scenario {' and '.join(worst)}; raise caps.force to "
        "this value, or relax or remove another cap",
        ExitCode.NOT_SOLVED,
    )


def who_gives_way(study: RobustTrussStudy, console: Console) -> str:
    """The smallest relaxation of the scenarios' minimum tensions, in words; empty if none is found.

    The limits of the motion stay: they are the same for all scenarios. The force has none here.
    """
    names = list(study.scenarios)
    titles = [ROPE_FORCE]
    if study.deployment.caps.least_tension:
        titles.append(QUANTITIES["least-tension"].title)
    owners = {
        bound: (title, named(study, scenario))
        for title in titles
        for bound, scenario in zip(bound_names(title, len(names)), names, strict=True)
    }
    for start in starting_laws(study.deployment):
        problem = _statement(study, start).problem()
        try:
            found = relaxed(problem, only=list(owners), settings=RELAXED, progress=console.live)
        except (OcpError, StudyError):
            continue
        said = [_given_way(*owners[_common(item.name)], item) for item in found.items]
        return "; ".join(said)
    return ""


def _given_way(title: str, scenario: str, item: Relaxed) -> str:
    """A limit of a scenario that is relaxed, in words."""
    return (
        f"with the smallest relaxation found (local, on one mesh) the {title} in scenario "
        f"{scenario} is at least {item.needed:.6g} N instead of {item.limit:.6g} N"
    )


def _common(name: str) -> str:
    """The name of a bound without that of its phase."""
    return name.rpartition(": ")[2]


def _from_all_starts(study: RobustTrussStudy, console: Console, kept: FinishedSteps) -> RobustLaw:
    statements, deployment = Statements(), study.deployment

    def stated(start: str) -> Problem:
        statement = _statement(study, start)
        return statements.noted(statement.problem(), statement)

    starts = {law: functools.partial(stated, law) for law in starting_laws(deployment)}
    found = from_starts(
        starts,
        statements,
        settings_of(deployment, with_forces=True),
        # corners that were found are scenarios, too: each set of them is a problem of its own
        kind=hashed(list(study.scenarios.values()))[:12],
        kept=kept,
        line=functools.partial(one_line, unit="N", title="worst force "),
        console=console,
        same=SAME,
        processes=1,
        seconds=deployment.solver.seconds,
    )
    best = found.optima[0].solution
    if not (found.interrupted or best.verification.passed):
        raise NoLawError("; ".join(best.verification.reasons))
    statement = statements.of[best.problem]
    return RobustLaw(found, best, law_of(deployment, statement, best), study, statement)


def _statement(study: RobustTrussStudy, start: str) -> Statement:
    # the worst force is what is least: a cap on it has no say in the search, but is checked after
    deployment = dataclasses.replace(
        study.deployment, caps=dataclasses.replace(study.deployment.caps, force=None)
    )
    pull = pull_of(deployment.truss, [study.values_of(s) for s in study.scenarios.values()])
    price = first_price(deployment, 0, WEIGHTS, with_forces=True)
    guess = starting_motion(start, deployment)
    return state(deployment, guess, WEIGHTS, with_forces=True, price=price, pull=pull)
