"""Settings: how they print, what they set, and the lines of progress."""

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
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    StatementError,
    solve,
)
from ocp.mesh.mesh import uniform
from ocp.problem.parameters import parameters_of
from ocp.progress import LiveLine
from ocp.refinement.mesh_solver import MeshSolver
from tests.ocp.problems import pendulum, solved_on


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
    found = solved_on(3, pendulum(), scheme=Radau(2))
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
    found = solve(pendulum(), settings=Settings(intervals=5), progress=True)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(found.mesh_iterations)
    assert lines[0] == "pendulum: mesh iteration 1 (5 intervals)"


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
