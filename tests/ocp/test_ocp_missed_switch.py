"""A switch at a breakpoint that cannot move: that it is found, moved or said."""

import numpy as np
import pytest

from ocp import (
    AdaptiveMesh,
    Between,
    Control,
    FixedMesh,
    Phase,
    Problem,
    Settings,
    State,
    solve,
)
from ocp.mesh.mesh import Mesh, PhaseMesh
from ocp.refinement.estimates.missed_switches import missed_switches
from ocp.refinement.estimates.switch_detection import control_jumps

# A mass waits at 0 m, as long as it can, and swings to 1 m at the end of the time, by 100 m/s^2 for
# 0.1 s and as much against it for 0.1 s. The least area under its position is 0.1 m s.
TIME, SWING, LEAST = 100.0, 0.2, 0.1


def wait():
    x, v = State("x", "m", lower=0), State("v", "m/s", lower=0)
    u = Control("u", "m/s^2", lower=-100, upper=100)
    times = [0, TIME - SWING, TIME - SWING / 2, TIME]
    guess = {
        x: lambda t: np.interp(t, times, [0, 0, 0.5, 1]),
        v: lambda t: np.interp(t, times, [0, 0, 10, 0]),
    }
    swing = Phase("swing", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=TIME, guess=guess)
    return Problem("wait", swing, minimise=swing.integral(x))


def missed(solution):
    jumps = control_jumps(solution.trajectory.phases[0])
    assert jumps
    return missed_switches(solution.iterate, solution.evaluator, 0, jumps)


def test_the_hamiltonian_jumps_at_a_switch_that_comes_too_late():
    # the last waiting interval ends 2 ms after the swing should begin: x has to move before
    points = [0, 50, 90, 99, TIME - SWING + 2e-3, TIME - SWING / 2 + 1e-3, TIME]
    mesh = Mesh((PhaseMesh(np.array(points) / TIME, 4),))
    found = solve(wait(), settings=Settings(refinement=FixedMesh()), mesh=mesh)
    assert found.objective > 1.02 * LEAST
    # each millisecond costs about one per cent, and the swing's first interval is 0.1 s long
    lost = missed(found)
    assert lost[3] + lost[4] > 0.5
    assert not lost[:3].any()


def test_a_switch_at_its_time_is_left_alone():
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2", lower=-1, upper=1)
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=Between(0.1, 10))
    assert not missed(solve(Problem("move", move, minimise=move.duration))).any()


def test_a_switch_that_was_missed_is_moved():
    # nine per cent were lost, with a promised gain of 7e-6
    found = solve(wait(), settings=Settings(iterations=2000))
    assert found.objective == pytest.approx(LEAST, rel=1e-4)


def test_a_switch_of_what_is_no_motion_gets_no_breakpoint(monkeypatch) -> None:
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2", lower=-1, upper=1)
    end = Between(0.1, 10, guess=3)
    move = Phase("move", {x: v, v: u - 0.1 * v**3}, {x: 0, v: 0}, {x: 3, v: 0}, end=end)
    problem = Problem("brisk", move, minimise=move.end_time)
    assert max(round.movable for round in solve(problem).mesh_iterations) == 1

    # with a limit of nothing, no mesh is a motion
    monkeypatch.setattr("ocp.refinement.policies.adaptive_mesh._A_MOTION", 0.0)
    found = solve(problem, settings=Settings(refinement=AdaptiveMesh(rounds=4), verify=False))
    assert max(round.movable for round in found.mesh_iterations) == 0
