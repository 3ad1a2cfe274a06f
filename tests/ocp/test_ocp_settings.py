"""Settings: what they refuse, with what to write instead, and what may be plugged in."""

import io
import math

import numpy as np
import pytest

from ocp import (
    Accuracy,
    AdaptiveMesh,
    Control,
    FixedMesh,
    Gauss,
    Ipopt,
    Mesh,
    MovingMesh,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    StatementError,
    Tolerances,
    solve,
)
from ocp.mesh.mesh import uniform
from ocp.problem.parameters import parameters_of
from ocp.progress import LiveLine
from ocp.refinement.mesh_solver import MeshSolver


def transfer() -> Problem:
    """1 m in 1 s from rest to rest with least effort, 12."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("move", {x: v, v: u}, initial={x: 0, v: 0}, final={x: 1, v: 0}, end=1.0)
    return Problem("transfer", phase, minimise=phase.integral(u**2))


def sway() -> Problem:
    """A pendulum brought to another angle: nonlinear, so that a coarse mesh is off."""
    import casadi as ca

    q, w, u = State("q", "rad"), State("w", "rad/s"), Control("u", "N m")
    phase = Phase(
        "sway", {q: w, w: u - 9.81 * ca.sin(q)}, initial={q: 0, w: 0}, final={q: 1, w: 0}, end=2
    )
    return Problem("sway", phase, minimise=phase.integral(u**2))


MISUSED = {
    "a degree": ({"degree": 3}, r"no keyword 'degree'; write scheme=Radau\(3\)"),
    "a solver's name": ({"solver": "ipopt"}, r"'solver' is 'ipopt'; give Ipopt\(\)"),
    "a scheme's name": ({"scheme": "gauss"}, r"'scheme' is 'gauss'; write scheme=Gauss\(\)"),
    "a class for a scheme": ({"scheme": Gauss}, r"'scheme' is .*; write Gauss\(\)"),
    "something else for a scheme": ({"scheme": 4}, r"'scheme' is 4; give one of Radau\(\), Gauss"),
    "a class for a solver": ({"solver": Ipopt}, r"'solver' is .*; give Ipopt\(\)"),
    "a flag for a policy": ({"refinement": False}, r"give AdaptiveMesh\(\) or FixedMesh\(\)"),
    "half an interval": ({"intervals": 2.5}, r"'intervals' is 2.5; give a positive integer"),
    "a misspelt keyword": ({"refinment": FixedMesh()}, r"'refinment'; did you mean 'refinement'\?"),
    "an unknown keyword": ({"turbo": True}, r"'turbo'; there are scheme, intervals, controls,"),
    "a budget of no time": ({"seconds": math.inf}, r"'seconds' is inf; give a positive number"),
}


@pytest.mark.parametrize("case", MISUSED)
def test_wrong_settings_are_answered_with_what_to_write(case) -> None:
    keywords, words = MISUSED[case]
    with pytest.raises(StatementError, match=words):
        Settings(**keywords)


OBJECTS = {
    "accuracy": (lambda: Accuracy(dynamic=1e-6), r"'dynamic'; did you mean 'dynamics'\?"),
    "a negative accuracy": (lambda: Accuracy(replay=-1.0), r"'replay' is -1.0; give a positive"),
    "adaptive mesh": (lambda: AdaptiveMesh(round=3), r"'round'; did you mean 'rounds'\?"),
    "no rounds": (lambda: AdaptiveMesh(rounds=0), r"'rounds' of an adaptive mesh is 0; give a pos"),
    "no intervals": (lambda: MovingMesh(most_intervals=0), r"of a moving mesh is 0; give a pos"),
    "half a degree": (lambda: FixedMesh(highest_degree=2.5), r"of a fixed mesh is 2.5; give a pos"),
    "endless iterations": (lambda: Ipopt(max_iterations=math.inf), r"is inf; give a whole number"),
    "tolerances": (lambda: Tolerances(gain=0), r"'gain' of a certificate is 0; give a positive"),
    "fixed mesh": (lambda: FixedMesh(rounds=3), r"FixedMesh has no keyword 'rounds'"),
    "Ipopt": (lambda: Ipopt(max_iteration=3), r"did you mean 'max_iterations'\?"),
    "an option of IPOPT": (
        lambda: Ipopt(options={"nonsense": 1}),
        r"IPOPT does not accept the option nonsense=1; see the list of options",
    ),
    "a value of IPOPT": (
        lambda: Ipopt(options={"mumps_pivot_order": 99}),
        r"does not accept the option mumps_pivot_order=99",
    ),
    "an option with a field": (
        lambda: Ipopt(options={"tol": 1e-8}),
        r"IPOPT's option 'tol' is a field; write Ipopt\(tolerance=1e-08\)",
    ),
    "Ipopt's tolerance": (lambda: Ipopt(tolerance=0), r"tolerance is 0; give a positive number"),
}


@pytest.mark.parametrize("case", OBJECTS)
def test_objects_of_the_settings_refuse_in_a_sentence(case) -> None:
    make, words = OBJECTS[case]
    with pytest.raises(StatementError, match=words):
        make()


def test_settings_print_as_one_would_write_them() -> None:
    assert repr(Settings()) == "Settings()"
    written = Settings(
        scheme=Gauss(3), refinement=AdaptiveMesh(rounds=3), solver=Ipopt(tolerance=1e-8)
    )
    assert repr(written) == (
        "Settings(scheme=Gauss(degree=3), refinement=AdaptiveMesh(rounds=3), "
        "solver=Ipopt(tolerance=1e-08))"
    )
    assert repr(FixedMesh()) == "FixedMesh()"
    assert repr(Accuracy(path=1e-9)) == "Accuracy(path=1e-09)"


ARGUMENTS = {
    "a phase": (
        lambda p: solve(p.phases[0]),
        r"'move' is a phase without an objective; write Problem\('move', phase, minimise=",
    ),
    "a misspelt keyword": (lambda p: solve(p, setting=Settings()), r"did you mean 'settings'\?"),
    "a table of settings": (lambda p: solve(p, settings={}), r"'settings' is of type dict; write"),
    "a pair as guess": (lambda p: solve(p, guess=(0, 1)), r"'guess' is of type tuple; .*Phase\(g"),
    "a number as mesh": (lambda p: solve(p, mesh=20), r"'mesh' is of type int; give a Mesh"),
    "a number as problem": (lambda p: solve(3), r"'problem' is of type int; give a Problem"),
    "a number as progress": (lambda p: solve(p, progress=1), r"progress is 1; give True"),
}


@pytest.mark.parametrize("case", ARGUMENTS)
def test_misuse_of_solve_is_answered_in_a_sentence(case) -> None:
    call, words = ARGUMENTS[case]
    with pytest.raises(StatementError, match=words):
        call(transfer())


def kept_from_the_objective(program, result, parameters) -> float:
    """Slacks of all limits times their multipliers."""
    limits = program.limits(parameters)
    pairs = (
        (limits.columns, result.x, result.bound_multipliers),
        (limits.rows, result.rows, result.row_multipliers),
    )
    total = 0.0
    for (lower, upper), values, multipliers in pairs:
        sided = lower < upper  # an equation keeps nothing
        slack = np.where(multipliers > 0, upper - values, values - lower)[sided]
        total += float(np.abs(slack * multipliers[sided]).sum())
    return total


def test_all_limits_together_keep_no_more_than_the_gap_from_the_objective() -> None:
    """Least effort with a force that limits hold at its ends, at 400 points."""
    x, v = State("x", "m", lower=-1, upper=2), State("v", "m/s", lower=-1, upper=3)
    u = Control("u", "m/s^2", lower=-5, upper=5)
    phase = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0)
    problem = Problem("effort", phase, minimise=phase.integral(u**2))
    meshes = MeshSolver.of(problem, Settings(), parameters_of(problem, None))
    program = meshes.first_program(None, Mesh((uniform(100, 4),)))

    rough = Ipopt().loosened(1e-6)
    kept = [
        kept_from_the_objective(program, meshes.solve(program, None, solver), meshes.parameters)
        for solver in (rough, rough.within_gap(1e-7))
    ]
    assert kept[0] > 1e-6  # each limit keeps less than that, all together more
    assert kept[1] <= 1e-7


def test_a_gap_is_never_made_wider() -> None:
    assert Ipopt(gap=1e-9).within_gap(1e-6).gap == 1e-9
    assert Ipopt().loosened(1e-6).within_gap(1e-6).gap == 1e-6


def test_a_fixed_mesh_is_solved_once_and_its_answer_returned_as_it_is() -> None:
    coarse = Settings(scheme=Radau(2), intervals=3, refinement=FixedMesh())
    found = solve(sway(), settings=coarse)
    assert len(found.mesh_iterations) == 1
    assert found.verdict == "unverified"
    np.testing.assert_allclose(found.mesh.phases[0].breakpoints, [0, 1 / 3, 2 / 3, 1])


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


def test_one_live_line_on_a_terminal() -> None:
    line = LiveLine(Terminal())
    for text in ("a long line, iteration 1", "short, iteration 2"):
        line(text)
    line.close()
    first, second = line.stream.getvalue().split("\r")[1:]
    assert first == "a long line, iteration 1"
    assert second == "short, iteration 2".ljust(len(first)) + "\n"


def test_one_line_a_mesh_round_elsewhere(capsys) -> None:
    found = solve(sway(), settings=Settings(intervals=5), progress=True)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(found.mesh_iterations)
    assert lines[0] == "sway: mesh iteration 1 (5 intervals)"


def test_solves_side_by_side_have_one_line_a_mesh_round_each() -> None:
    line = LiveLine(io.StringIO())
    for iteration in range(3):
        for start in ("start 1: sway", "start 2: sway"):
            line(f"{start}: mesh iteration 1 (5 intervals), iteration {iteration}")
    line("start 2 done")
    line("start 3: sway: mesh iteration 1 (5 intervals), iteration 0")
    assert line.stream.getvalue().splitlines() == [
        "start 1: sway: mesh iteration 1 (5 intervals)",
        "start 2: sway: mesh iteration 1 (5 intervals)",
        "start 2 done",
        "start 3: sway: mesh iteration 1 (5 intervals)",
    ]


def test_one_number_is_the_accuracy_of_all():
    settings = Settings(accuracy=1e-4)
    assert settings.accuracy == Accuracy(objective=1e-4, dynamics=1e-4, path=1e-4, replay=1e-4)
    assert Settings(accuracy=np.float64(1e-4)) == settings
    assert Settings().accuracy == Accuracy()
    assert eval(repr(settings)) == settings


@pytest.mark.parametrize("value", [0, -1e-3, 0.1, 1, math.nan, math.inf, "1e-4", None, True])
def test_an_accuracy_is_a_positive_number_below_a_tenth(value):
    with pytest.raises(StatementError, match=r"'accuracy' is .*; give a positive number below 0.1"):
        Settings(accuracy=value)


def test_round_off_does_not_allow_any_accuracy():
    with pytest.raises(StatementError, match="'accuracy' is 1e-12; give 1e-09, the least that"):
        Settings(accuracy=1e-12)
    assert Settings(accuracy=1e-9).accuracy.objective == 1e-9
