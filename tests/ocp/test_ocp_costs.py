"""When a refinement ends because a better motion would cost too much."""

import pytest

from ocp import Accuracy, Between, Control, Phase, Problem, Settings, State, solve
from ocp.refinement import endings

FEW = Settings(intervals=5)


def drive():
    """A way in little time and with little effort, below a speed: its limit leaks for long."""
    x, v = State("x"), State("v", upper=1)
    u = Control("u", lower=-1, upper=1)
    phase = Phase(
        "drive", {x: v, v: u - v**2 / 2}, {x: 0, v: 0}, {x: 3, v: 0}, end=Between(1, 9, guess=4)
    )
    return Problem("drive", [phase], minimise=phase.duration + phase.integral(u**2) / 10)


def test_a_dear_solve_ends_if_it_is_accurate_and_finer_meshes_bring_little(monkeypatch):
    full = solve(drive(), settings=FEW)
    monkeypatch.setattr(endings, "MUCH", 0.0)
    found = solve(drive(), settings=FEW)
    assert len(found.mesh_iterations) <= len(full.mesh_iterations)
    assert "no finer mesh improved it" in full.verdict
    assert "further meshes would cost much for little" in found.verdict
    assert abs(found.objective - full.objective) / full.objective <= found.accuracy <= 1e-4


@pytest.mark.parametrize("asked", [{"seconds": 600.0}, {"accuracy": Accuracy(objective=2e-6)}])
def test_who_states_an_accuracy_or_seconds_gets_it(monkeypatch, asked):
    monkeypatch.setattr(endings, "MUCH", 0.0)
    found = solve(drive(), settings=Settings(intervals=5, **asked))
    assert "would cost" not in found.verdict
