"""Looks for the best motion of the truss from several starts, and says what it found.

The steps that follow the starts are in `judged_motion`.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from ocp import Audit, Interrupted, OcpError, Trial
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.truss.config import TrussStudy
from studies.truss.motions.starts import (
    KINDS,
    PHASE_PLANE,
    from_neighbour,
    in_order,
)
from studies.truss.problem import control_of
from studies.truss.search.best_motion import BestMotion, NoMotionError
from studies.truss.search.first_mesh import ends_alike
from studies.truss.search.from_starts import Starts, Statements, from_starts
from studies.truss.search.judged_motion import STOPPED, judged_motion
from studies.truss.search.missed_cap import (
    CapsMissedError,
    curve_in_words,
    hard_cap,
    hard_caps,
    solved_soon,
    together,
)
from studies.truss.search.proofs import (
    ProvenBounds,
    bounds_in_closed_form,
    check_some_optimum,
    proven_bounds,
)
from studies.truss.search.question import Question
from studies.truss.search.relaxation import relaxation_in_words
from studies.truss.search.verdict import BOUND_MET, of_trial, starts_agree

Known = Trial | Callable[[], Trial | None]
Least = Callable[[], BestMotion | None]  # of the hardest cap, under the others; worked out once


def best_motion(question: Question) -> BestMotion:
    """Search for the best motion, first without forces where they do not matter.

    Raises
    ------
    StudyError
        If no motion was found.
    """
    study = question.study
    least = functools.cache(lambda: _least_of_the_hard_cap(question))
    best = _from_all_starts(question, least)
    if question.with_forces or best.deployment.values["least-tension"] >= study.caps.least_tension:
        return best
    if best.interrupted:  # what was found is no motion that the rope can pull
        raise StudyError(STOPPED, ExitCode.INTERRUPTED)
    question.console.progress(
        "the rope would have to push: solving again with the rope forces in the problem"
    )
    again = replace(question, checked=question.planes, rope_pulls=True, statements=Statements())
    best = _from_all_starts(again, least)
    pulled = "The rope's pull limits this motion (T1 >= 0 is active)."
    return replace(best, remarks=(pulled, *best.remarks))


def _from_all_starts(question: Question, least: Least) -> BestMotion:
    """The best of all starts, one after the other until one meets the bound or enough agree."""
    names, done = _names(question), list[Trial]()
    try:
        return _from_some(question, _starts(question, names), least, done)
    except CapsMissedError as missed:
        count = len(hard_caps(question.study))
        # a search for a least value is part of the table itself
        if question.enough is not None or count < 2:
            raise
        question.console.progress(
            "no motion was found that keeps all caps: searching the minimum of each capped quantity"
        )
        share = question.some_left() / (2 * count + 1)
        found = functools.partial(_least_value, question.console)
        raise together(question.study, found, share) from missed
    except Interrupted as stop:
        raise StudyError(STOPPED, ExitCode.INTERRUPTED) from stop
    except (OcpError, NoMotionError) as error:
        raise _none_found(question, names, max(len(done), 1), error, least) from error


def _names(question: Question) -> list[str]:
    """The study's starts in their order."""
    force_drives = control_of(question.study, question.with_forces)[0] == "force"
    names = in_order(question.study.solver.starts, force_drives)
    if question.with_forces:
        return names
    # the phase plane of the force says nothing here
    return [name for name in names if name != PHASE_PLANE] or names


def _starts(question: Question, names: Sequence[str]) -> Starts:
    """The starts by name, a neighbour's motion before all others; each is stated in its turn."""
    starts = {name: functools.partial(question.problem_from_start, name) for name in names}
    if question.neighbour is None:
        return starts
    near = from_neighbour(question.neighbour, question.study)
    return {near.name: functools.partial(question.problem_from, near), **starts}


def _from_some(
    question: Question,
    starts: Starts,
    least: Least,
    done: list[Trial],
) -> BestMotion:
    """The best of some starts.

    Parameters
    ----------
    done : list of Trial
        Receives each start that is done.

    Raises
    ------
    CapsMissedError
        If the first finds none and a cap is missed.
    Interrupted
        If the user stopped it before a motion was found.
    """
    soon, stopped = solved_soon(question, starts)
    if soon is not None and soon.error is not None:
        if stopped:
            raise Interrupted(STOPPED) from soon.error
        _check_the_least(question, soon, least)
        soon = None
    known = {} if soon is None else {soon.name: soon}
    found, bounds = _audited(question, starts, done, known, stopped=stopped)
    return judged_motion(question, found, bounds)


def _check_the_least(question: Question, soon: Trial, least: Least) -> None:
    """Refuse a hard cap below the least found of what it is on; Interrupted if stopped."""
    hard = hard_cap(question.study)
    assert hard is not None
    question.console.progress(f"{soon.name}: no motion was found in the first attempt")
    if (found := least()) is not None:
        if found.interrupted:
            raise Interrupted(STOPPED)
        hard.check(question.study, found)


def _audited(
    question: Question,
    starts: Starts,
    done: list[Trial],
    known: Mapping[str, Known],
    *,
    stopped: bool = False,
) -> tuple[Audit, ProvenBounds]:
    """What came of starts, and the bounds that they were held against.

    Parameters
    ----------
    done : list of Trial
        Receives each start that is done.
    known : mapping of name to Trial
        Those of this run. Those that an earlier run has finished are read.
    stopped : bool
        Whether the user has asked to stop, so that what is known is all that there is.
    """
    study = question.study
    bounds = bounds_in_closed_form(study, interrupted=stopped)

    def bound() -> float | None:
        """The bound of the first objective; it ends the audit where the user stopped its search."""
        nonlocal bounds
        if not stopped and question.enough is None:
            bounds = proven_bounds(question.planes)
        if bounds.interrupted:
            raise KeyboardInterrupt
        return bounds.first(study)

    def enough(trials: Sequence[Trial]) -> bool:
        last = trials[-1]
        if question.enough is not None and last.error is None and last.value <= question.enough:
            return True
        return starts_agree(list(starts), trials, question.same)

    def line(trial: Trial, earlier: bool) -> str:
        before = [other.name for other in done if other.solution is trial.solution is not None]
        done.append(trial)
        label = f"start {len(done)} of {len(starts)} ({trial.name})"
        if before:
            return f"{label}: by its first mesh it ends where {before[0]} does"
        return f"{label}: {of_trial(trial, study)}{', in an earlier run' if earlier else ''}"

    if study.arm is not None:  # a motion with an arm takes half a minute
        names = starts.keys() - set(question.kept.names(question.kind))
        alike = {
            name: functools.partial(ends_alike, question, name, starts[name], done)
            for name in names
        }
        known = {**alike, **known}
    found = from_starts(
        starts,
        question.statements,
        question.settings,
        kind=question.kind,
        kept=question.kept,
        # another start than a law begins where a search ended
        again={name: start for name, start in starts.items() if name in KINDS},
        known=known,
        line=line,
        console=question.console,
        bound=bound,
        bound_gap=BOUND_MET,
        same=question.same,
        enough=enough,
        seconds=question.some_left(),
    )
    return found, bounds


def _none_found(
    question: Question, names: Sequence[str], tried: int, error: Exception, least: Least
) -> StudyError:
    """What to raise where every start failed: what would have to be relaxed, and the first error.

    Parameters
    ----------
    names, tried : of the starts, and how many of them were tried.
    error : of the first start.
    """
    study, hard = question.study, hard_cap(question.study)
    needed, interrupted = "the relaxed problem was not solved either", False
    try:
        if hard is not None and (found := least()) is not None:
            needed, interrupted = hard.needed(found), found.interrupted
        elif hard is None and question.enough is None:
            question.console.progress("no motion was found: searching for the smallest relaxation")
            problem = question.problem_from_start("bezier")
            needed = relaxation_in_words(problem, question.console.live) or needed
    except Interrupted:
        interrupted = True

    starts = f"{len(names)} start{'s' * (len(names) > 1)}"
    if tried < len(names):  # the budget ended before the others
        starts = (
            f"{tried} of {starts}, because the time limit was reached; raise --seconds to try more"
        )
    return StudyError(
        f"no motion was found from {starts}; the smallest relaxation found: {needed}"
        f"{curve_in_words(study)}; from {names[0]}: {error}",
        ExitCode.INTERRUPTED if interrupted else ExitCode.NOT_SOLVED,
    )


def _least_of_the_hard_cap(question: Question) -> BestMotion | None:
    """The motion with the least of the hardest cap under the other caps; None if none is found.

    A search of its own, from one start of each kind: `ocp.relaxed` answers at once, but on a fixed
    mesh it is 0.2 to 1.5 % off, and on an adapting one it takes far longer than this.

    Raises
    ------
    CapsMissedError
        If the other caps alone are missed.
    Interrupted
        If the user stopped it before a motion was found.
    """
    hard = hard_cap(question.study)
    assert hard is not None
    title = hard.quantity.title
    question.console.progress(f"searching for the minimum under the other caps: {title}")
    try:
        lifted = hard.lifted(question.study, question.some_left())
        kept = question.kept.within(f"least {hard.key}")
        return best_motion(Question(lifted, question.console, enough=hard.enough, kept=kept))
    except (CapsMissedError, Interrupted):
        raise
    except KeyboardInterrupt as stop:
        raise Interrupted(STOPPED) from stop
    except StudyError as error:
        if error.exit_code is ExitCode.INTERRUPTED:
            raise Interrupted(STOPPED) from error
        return None
    except OcpError:
        return None


def _least_value(console: Console, study: TrussStudy, key: str) -> float | None:
    """About the least value of a quantity that a study minimises; None if none is found."""
    try:
        planes = check_some_optimum(study, console)
        return best_motion(Question(study, console, planes, enough=0.0)).deployment.values[key]
    except StudyError as error:
        if error.exit_code is ExitCode.INTERRUPTED:
            raise
        return None
