"""The cases, and all that is known here of `ocp` and `studies`; `... cases NAME FILE` runs one.

Each case states a problem as a user would and solves it with default settings. Mesh iterations and
iterations are counted where the engine solves a mesh iteration, so that failed solves count too.
"""

from __future__ import annotations

import contextlib
import functools
import json
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from inspect import isfunction
from pathlib import Path
from types import ModuleType
from typing import Any, cast
from unittest import mock

from benchmarks.records import ROOT, Record

RACE_ROWS = ROOT / "benchmarks" / "race" / "rows"  # scripts that import each other by plain names
MAIN_STUDY = ROOT / "studies" / "truss" / "main.toml"
ROUND_SOLVER = "with_retries"  # the engine's function that solves one mesh iteration

ENGINE_TOLERANCE = 1e-5  # ten times the default tolerance on the objective
TRUSS_TOLERANCE = 1e-4  # within it the truss study counts two optima as one
ARM_TOLERANCE = 1e-4  # of one stated mesh; its error is judged by replays, not by the objective

TRUSS_STUDIES: Mapping[str, Mapping[str, Any] | None] = {
    "truss_main": None,  # from its file
    "truss_force_5s": {
        "minimise": "peak-force",
        "duration": 5.0,
        "caps": {"jerk": "200/T^3"},
        "truss": {"pulley_friction": 0.01},
    },
    "truss_rope_acceleration": {
        "minimise": "peak-rope-acceleration",
        "duration": 140.0,
        "caps": {"jerk": "200/T^3"},
    },
    "truss_time": {
        "minimise": "time",
        "duration": [2.0, 60.0],
        "caps": {"force": 45.0, "jerk": 0.5},
    },
    "truss_energy": {"minimise": "energy", "caps": {"jerk": "bezier"}},
}
ARM_STUDIES: Mapping[str, Mapping[str, Any]] = {
    "arm_big": {"stage": "big", "torque_cap": 4.55},
    "arm_small": {"stage": "small"},
}


@dataclass(frozen=True)
class Answer:
    """What a case returns.

    Attributes
    ----------
    value : of the objective.
    tolerance : of the value, relative.
    solution : of the engine, to be certified.
    verdict : in words.
    study_checks : (name, passed) of what the study checks beside the engine.
    seconds : processor time spent [s].
    """

    value: float
    tolerance: float
    solution: Any
    verdict: str
    seconds: float
    study_checks: tuple[tuple[str, bool], ...] = ()


@dataclass
class Effort:
    """What the solves of a process took so far."""

    rounds: int = 0
    iterations: int = 0


def names() -> tuple[str, ...]:
    """All cases, in the order in which they are run."""
    from benchmarks.optima.catalogue import CATALOGUE

    return (*CATALOGUE, "race_A", "race_B", *ARM_STUDIES, *TRUSS_STUDIES)


def case(name: str) -> Callable[[], Answer]:
    """The case of a name."""
    if name in ARM_STUDIES:
        return functools.partial(_arm, ARM_STUDIES[name])
    if name in TRUSS_STUDIES:
        return functools.partial(_truss, TRUSS_STUDIES[name])
    if name.startswith("race_"):
        return functools.partial(_race, name.removeprefix("race_"))
    return functools.partial(_benchmark, name)


def measure(name: str) -> Record:
    """Solve a case and certify its answer; a failure is a record too."""
    from ocp import OcpError, certify
    from studies.common.exit_codes import StudyError

    with counted_effort() as effort:
        begin = time.process_time()
        try:
            answer = case(name)()
        except (OcpError, StudyError) as error:
            seconds = time.process_time() - begin
            failure = f"{type(error).__name__}: {error}"
            return Record(
                name, None, 0.0, effort.rounds, effort.iterations, seconds, failure=failure
            )

    # counted no longer: a certificate is no part of the effort
    certificate = certify(answer.solution)
    outcomes = [*((c.name, not c.failed) for c in certificate.checks), *answer.study_checks]
    return Record(
        name=name,
        value=answer.value,
        tolerance=answer.tolerance,
        rounds=effort.rounds,
        iterations=effort.iterations,
        seconds=answer.seconds,
        checks=len(outcomes),
        failed_checks=tuple(check for check, passed in outcomes if not passed),
        verdict=answer.verdict,
    )


@contextlib.contextmanager
def counted_effort() -> Iterator[Effort]:
    """Count rounds and iterations of every solve inside the block."""
    import_module("ocp.algorithm")  # and with it all modules that solve a round
    (solve_round,) = {getattr(module, ROUND_SOLVER) for module in _loaded("ocp", ROUND_SOLVER)}
    effort = Effort()

    def counted_round(*arguments: Any, **options: Any) -> Any:
        result = solve_round(*arguments, **options)
        effort.rounds += 1
        effort.iterations += result.iterations
        return result

    with _replaced("ocp", ROUND_SOLVER, counted_round):
        yield effort


@contextlib.contextmanager
def _replaced(package: str, function: str, replacement: Any) -> Iterator[None]:
    """Replace a function in all loaded modules of a package, wherever they are."""
    with contextlib.ExitStack() as patches:
        for module in _loaded(package, function):
            patches.enter_context(mock.patch.object(module, function, replacement))
        yield


def _loaded(package: str, function: str) -> list[ModuleType]:
    """The loaded modules below a package that define or import a function of this name."""
    below = [module for name, module in sys.modules.items() if name.startswith(package + ".")]
    return [module for module in below if isfunction(vars(module).get(function))]


def _solved(problem: Any, tolerance: float) -> Answer:
    """A stated problem, solved with default settings; an unverified answer counts as one."""
    from ocp import Solution, StatementWarning, Unverified, solve

    begin = time.process_time()
    with warnings.catch_warnings():
        # statements of the literature carry along what nothing depends on, such as a longitude
        warnings.simplefilter("ignore", StatementWarning)
        try:
            solution = solve(problem)
        except Unverified as error:
            solution = cast(Solution, error.iterate)
    seconds = time.process_time() - begin
    return Answer(solution.objective, tolerance, solution, solution.verdict, seconds)


def _benchmark(name: str) -> Answer:
    """One problem of the catalogue, held against its trusted optimum."""
    from benchmarks.optima.catalogue import CATALOGUE
    from benchmarks.optima.checks import held_against

    benchmark = CATALOGUE[name]()
    answer = _solved(benchmark.problem, benchmark.tolerance)
    return replace(answer, study_checks=held_against(benchmark, answer.solution))


def _race(name: str) -> Answer:
    """Problem A or B of the race, as our own row states it."""
    sys.path.insert(0, str(RACE_ROWS))
    problem, _ = import_module("run_ours").statement(name)
    return _solved(problem, ENGINE_TOLERANCE)


def _arm(given: Mapping[str, Any]) -> Answer:
    """One stage of the arm, solved and refined as its command does."""
    from studies.arm.config import study_from
    from studies.arm.optimal.refinement import refine
    from studies.arm.optimal.solve import solve_stage
    from studies.arm.questions.one_motion import check_study

    study = study_from(given)
    begin = time.process_time()
    check_study(study)
    refined = refine(solve_stage(study.slew, caps=study.caps, objective=study.objective))
    seconds = time.process_time() - begin

    solution = refined.motion.solution
    agreement = ("study: the full model is still, no finer motion is better", refined.resolved)
    return Answer(
        solution.objective, ARM_TOLERANCE, solution, solution.verdict, seconds, (agreement,)
    )


def _truss(given: Mapping[str, Any] | None) -> Answer:
    """One study of the truss, from all its starts, as its command does."""
    from studies.common.configuration import read_toml
    from studies.common.console import silent
    from studies.truss.checks import criteria
    from studies.truss.config import study_from
    from studies.truss.search.motion_search import best_motion
    from studies.truss.search.proofs import check_some_optimum
    from studies.truss.search.question import Question

    study = study_from(read_toml(MAIN_STUDY) if given is None else given)
    begin = time.process_time()
    best = best_motion(Question(study, silent(), check_some_optimum(study, silent())))
    seconds = time.process_time() - begin

    study_checks = tuple(
        (f"study: {check.name}", check.passed) for check in criteria(study, best.deployment)
    )
    value = best.deployment.values[study.objectives[0]]
    verdict = best.verdict.sentence
    return Answer(value, TRUSS_TOLERANCE, best.solution, verdict, seconds, study_checks)


def main() -> None:
    """Run the case named first and write its record to the file named second."""
    name, file = sys.argv[1:]
    Path(file).write_text(json.dumps(measure(name).as_dictionary()), "utf-8")


if __name__ == "__main__":
    main()
