"""IPOPT's objects that serve several runs of a program."""

import gc
import weakref

import casadi as ca
import numpy as np
import pytest

from ocp import Ipopt, Settings, prepare
from ocp.nlp.kept import KeptSolver
from ocp.nlp.solver import Listener, NlpResult, StartingPoint
from ocp.problem.parameters import parameters_of
from ocp.transcription.kernels import Block, Kernel, Program
from ocp.transcription.transcribe import ProgramLimits, Transcription
from tests.ocp.problems import race


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[KeptSolver]:
    """All objects made in a test."""
    found: list[KeptSolver] = []
    make = KeptSolver.of

    def noted(*arguments: object) -> KeptSolver:
        found.append(make(*arguments))
        return found[-1]

    monkeypatch.setattr(KeptSolver, "of", noted)
    return found


def prepared() -> Transcription:
    """The program of the least time between two points of rest."""
    return prepare(race(), settings=Settings(intervals=6)).transcription


def run(
    program: Transcription,
    solver: Ipopt | None = None,
    before: NlpResult | None = None,
    listener: Listener | None = None,
) -> NlpResult:
    parameters = parameters_of(program.problem)
    limits, start = program.limits(parameters), np.full(program.program.variables, 0.5)
    point = StartingPoint(start)
    if before is not None:
        point = StartingPoint(before.x, (before.bound_multipliers, before.row_multipliers))
    solver = solver or Ipopt()
    return solver.solve(program.program, point, limits, parameters.vector, listener)


def equal(a: NlpResult, b: NlpResult) -> bool:
    """To the last digit."""
    arrays = ("x", "rows", "bound_multipliers", "row_multipliers")
    same = all(np.array_equal(getattr(a, name), getattr(b, name)) for name in arrays)
    return same and (a.objective, a.iterations) == (b.objective, b.iterations)


def test_a_second_run_is_the_first_one_again(made: list[KeptSolver]) -> None:
    program = prepared()
    first, again = run(program), run(program)
    assert len(made) == 1
    assert equal(first, again)
    assert equal(first, run(prepared()))
    assert len(made) == 2


def test_warm_and_cold_runs_by_turns_do_not_disturb_each_other(made: list[KeptSolver]) -> None:
    program = prepared()
    cold = run(program)
    warm = run(program, before=cold)
    assert equal(cold, run(program))
    assert equal(warm, run(program, before=cold))
    assert equal(warm, run(program, before=cold))
    assert len(made) == 2


def test_other_options_are_another_object(made: list[KeptSolver]) -> None:
    program = prepared()
    run(program)
    short = run(program, Ipopt(max_iterations=2))
    assert short.outcome == "budget"
    assert run(program).outcome == "solved"
    assert len(made) == 2


def test_no_more_than_two_are_kept(made: list[KeptSolver]) -> None:
    program = prepared()
    for most in (100, 200, 300):
        run(program, Ipopt(max_iterations=most))
    assert len(made) == 3
    run(program, Ipopt(max_iterations=300))
    run(program, Ipopt(max_iterations=200))
    assert len(made) == 3
    run(program, Ipopt(max_iterations=100))
    assert len(made) == 4


def test_a_run_within_a_run_has_an_object_of_its_own(made: list[KeptSolver]) -> None:
    program, inner = prepared(), list[NlpResult]()

    def listener(number: int, *_: object) -> bool:
        if number == 2:
            inner.append(run(program))
        return False

    outer = run(program, listener=listener)
    assert len(made) == 2
    assert equal(outer, inner[0])
    assert equal(outer, run(program))
    assert len(made) == 2


def test_a_listener_that_fails_or_stops_leaves_the_object_as_it_was() -> None:
    program = prepared()
    first = run(program)

    def failing(*_: object) -> bool:
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        run(program, listener=failing)
    assert run(program, listener=lambda number, *_: number == 1).outcome == "interrupted"
    assert equal(first, run(program))


def test_the_object_goes_with_its_program(made: list[KeptSolver]) -> None:
    program = prepared()
    run(program)
    kept = weakref.ref(made.pop())
    assert kept() is not None
    del program
    gc.collect()
    assert kept() is None


def test_a_program_without_rows_is_watched_too() -> None:
    w, d, c = (ca.SX.sym(name, size) for name, size in zip("wdc", (1, 0, 0), strict=True))
    kernel = Kernel(ca.Function("kernel", [w, d, c], [(w - 3) ** 2, ca.SX(0, 1)]))
    nothing = np.empty((1, 0))
    block = Block("bowl", kernel, np.zeros((1, 1), np.int64), nothing, nothing.astype(np.int64))
    limits = ProgramLimits((np.zeros(1), np.full(1, 2.0)), (np.empty(0), np.empty(0)))
    found = Ipopt().solve(
        Program((block,), 1, 0, 0), StartingPoint(np.ones(1)), limits, np.empty(0)
    )
    assert found.outcome == "solved"
    assert found.x == pytest.approx([2.0])
