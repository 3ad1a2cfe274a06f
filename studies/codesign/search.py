"""Motion and mechanism as one nonlinear program, solved from several designs and laws.

Near the best design the force is flat: the last digits of an optimum take ten times the iterations
of all before. So starts are solved roughly, and only the best of them to the engine's own accuracy.
"""

from __future__ import annotations

import dataclasses
import functools
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from models.truss import TrussParameters, with_symbols
from ocp import (
    Accuracy,
    Audit,
    Interrupted,
    OcpError,
    Problem,
    Settings,
    Solution,
    Unknown,
    solve,
)
from ocp.solution.storage import tabulated
from studies.codesign.config import UNITS, CodesignStudy
from studies.codesign.requirements import LEAST_RATIO, Requirement
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps, mark
from studies.common.processes.side_by_side import allowed_processes, script_left_out
from studies.common.result import Criterion
from studies.common.second_solve import second_solve
from studies.truss.config import TrussStudy
from studies.truss.motions.starts import KINDS, starting_laws, starting_motion
from studies.truss.problem import Statement, settings_of, state
from studies.truss.quantities import OBJECTIVES
from studies.truss.search.from_starts import Starts, Statements, from_starts, one_line
from studies.truss.search.smoothness import first_price

SAME = 1e-4  # relative: optima closer than this are one
GAIN = 1e-3  # relative: what a second solve may find, as the force is flat near the best design
ROUGH = 1e-5  # relative: to which starts are solved; well below what tells optima apart
STATED = "given design"
ROUGHLY, EXACTLY = "rough", "accurate"  # names of finished steps
MOST_DRAWS = 1000  # for designs whose link is longer than their crank


@dataclass(frozen=True, eq=False)
class BestDesign:
    """What the starts of a co-design came to.

    Attributes
    ----------
    audit : of all starts.
    statement : of the best one.
    design : its parameters that were free, by name.
    exact : whether the best one was solved to the engine's own accuracy, and not to `ROUGH` only.
    second : what a second solve says of it, where the user did not stop before.
    """

    audit: Audit
    statement: Statement
    design: Mapping[str, float]
    exact: bool = True
    second: tuple[Criterion, ...] = ()


def search(
    study: CodesignStudy,
    held: Sequence[Requirement],
    seconds: float,
    console: Console,
    kept: FinishedSteps = NOTHING_KEPT,
) -> BestDesign:
    """Solve from all starts.

    Parameters
    ----------
    study : CodesignStudy
        Its caps hold for the motion.
    held : sequence of Requirement
        Those at rest follow from the caps, and are left out.
    seconds : float
        That it may take [s].
    kept : FinishedSteps, optional
        Where finished steps go to, and where those of an earlier run are read.

    Raises
    ------
    StudyError
        If no start gave a design.
    """
    begin, statements = clock.monotonic(), Statements()
    starts = {
        f"{name}, {law}": functools.partial(_stated, study, held, law, guess, statements)
        for name, law, guess in _starts(study)
    }
    settings = settings_of(study.deployment, True, Accuracy())
    found = _roughly(study, starts, statements, settings, seconds, console, kept)

    def left() -> float:
        return seconds - (clock.monotonic() - begin)

    found, exact = _to_the_last_digits(found, settings, statements.value, left(), console, kept)
    second: tuple[Criterion, ...] = ()
    if exact and not found.interrupted and found.optima[0].solution.verification.passed:
        found, check = _a_second_time(found, settings, statements.value, left(), console, kept)
        second = (check,)

    best = found.optima[0].solution
    design = {u.name.replace(" ", "_"): best.value(u) for u in best.problem.unknowns}
    return BestDesign(found, statements.of[best.problem], design, exact, second)


def _stated(
    study: CodesignStudy,
    held: Sequence[Requirement],
    law: str,
    guess: Mapping[str, float],
    statements: Statements,
) -> Problem:
    """The problem with a law and a design as its guess."""
    unknowns = _unknowns(study, guess)
    truss = with_symbols(study.deployment.truss, **{k: u.symbol for k, u in unknowns.items()})
    statement = _statement(study.deployment, law, truss)
    bounds = [one.bound(truss) for one in held if not one.at_rest]
    # as it comes to another process, so that the answer is the same for any number of them
    return statements.noted(tabulated(statement.problem(bounds)), statement)


def _roughly(
    study: CodesignStudy,
    starts: Starts,
    statements: Statements,
    settings: Settings,
    seconds: float,
    console: Console,
    kept: FinishedSteps,
) -> Audit:
    """What comes of all starts, side by side."""
    try:
        with script_left_out():
            return from_starts(
                starts,
                statements,
                dataclasses.replace(settings, accuracy=Accuracy(objective=ROUGH)),
                kind=ROUGHLY,
                kept=kept,
                line=functools.partial(one_line, unit=OBJECTIVES[study.objective].unit),
                console=console,
                same=SAME,
                processes=allowed_processes(),
                seconds=seconds,
            )
    except Interrupted as stop:
        raise StudyError("interrupted before a design was found", ExitCode.INTERRUPTED) from stop
    except OcpError as error:
        raise StudyError(
            f"no design was found from {len(starts)} starts; from {next(iter(starts))}: {error}",
            ExitCode.NOT_SOLVED,
        ) from error


def _to_the_last_digits(
    found: Audit,
    settings: Settings,
    force: Callable[[Problem, Solution], float],
    seconds: float,
    console: Console,
    kept: FinishedSteps,
) -> tuple[Audit, bool]:
    """The best of rough starts solved on to the accuracy of the settings, and whether it was.

    It stays as it is where nothing is left of the seconds, or the solver comes no further.
    """
    best = found.optima[0]
    if found.interrupted or seconds <= 0.0:
        return found, False
    name, problem = best.starts[0], best.solution.problem
    console.progress(f"{name}: solving the best start to full accuracy")

    within = dataclasses.replace(settings, seconds=min(seconds, settings.seconds or seconds))
    try:
        finer = kept.step(
            EXACTLY,
            lambda: solve(
                problem,
                settings=within,
                guess=best.solution,
                progress=console.live,
                partial=False,
            ),
            problem,
            console.progress,
            begins_with=mark(best.solution),
        )
    except Interrupted:
        return dataclasses.replace(found, interrupted=True), False
    except OcpError as error:
        console.progress(f"{name}: not solved to full accuracy, {error}")
        return found, False

    value = force(problem, finer)
    trials = tuple(
        dataclasses.replace(
            trial, solution=finer, value=value, seconds=trial.seconds + finer.seconds
        )
        if trial.name == name
        else trial
        for trial in found.trials
    )
    better = dataclasses.replace(best, solution=finer, value=value)
    return dataclasses.replace(found, trials=trials, optima=(better, *found.optima[1:])), True


def _a_second_time(
    found: Audit,
    settings: Settings,
    force: Callable[[Problem, Solution], float],
    left: float,
    console: Console,
    kept: FinishedSteps,
) -> tuple[Audit, Criterion]:
    """The audit with the answer that a second solve leaves, and what it says of it."""
    best = found.optima[0]
    second = second_solve(best.solution, settings, console, left=left, gain=GAIN, kept=kept)
    solution = second.solution
    better = dataclasses.replace(best, solution=solution, value=force(solution.problem, solution))
    optima = (better, *found.optima[1:])
    return dataclasses.replace(found, optima=optima, interrupted=second.interrupted), second.check


def _unknowns(study: CodesignStudy, guess: Mapping[str, float]) -> dict[str, Unknown]:
    limits = study.design.limits(study.deployment.truss)
    return {
        name: Unknown(
            name.replace("_", " "),
            UNITS[name],
            lower=low,
            upper=high,
            guess=guess[name],
            scale=high,
        )
        for name, (low, high) in limits.items()
    }


def _statement(study: TrussStudy, law: str, truss: TrussParameters) -> Statement:
    weights = dict.fromkeys(OBJECTIVES, 1.0)
    price = first_price(study, 0, weights, with_forces=True)
    start = starting_motion(law, study)
    return state(study, start, weights, with_forces=True, price=price, truss=truss)


def _starts(study: CodesignStudy) -> list[tuple[str, str, dict[str, float]]]:
    """Name, law and parameters of each start: slow laws and laws with momentum alternate."""
    kinds = {KINDS[law]: law for law in reversed(starting_laws(study.deployment))}
    turns = list(kinds.values())

    truss, design = study.deployment.truss, study.design
    stated = {name: float(getattr(truss, name)) for name in design.free}
    found = [(STATED, law, stated) for law in turns]
    for place, guess in enumerate(_drawn(study, design.starts - 1), start=1):
        found.append((f"design {place}", turns[place % len(turns)], guess))
    return found


def _drawn(study: CodesignStudy, count: int) -> list[dict[str, float]]:
    """Designs from the range, even in each parameter, whose links are long enough."""
    generator = np.random.default_rng(study.design.seed)
    limits = study.design.limits(study.deployment.truss)
    low, high = np.array(list(limits.values())).T
    found: list[dict[str, float]] = []
    for _ in range(MOST_DRAWS):
        if len(found) == count:
            break
        guess = dict(zip(limits, generator.uniform(low, high).tolist(), strict=True))
        truss = with_symbols(study.deployment.truss, **guess)
        if truss.link > LEAST_RATIO * truss.crank:
            found.append(guess)
    return found


def designed(study: TrussStudy, design: Mapping[str, float]) -> TrussStudy:
    """The study of the truss with the parameters of a design."""
    changes: dict[str, Any] = dict(design)
    return dataclasses.replace(study, truss=dataclasses.replace(study.truss, **changes))
