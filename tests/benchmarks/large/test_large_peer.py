"""Answers of a peer on large problems: read as motions, and judged as those of the engine."""

import numpy as np
import pytest

from benchmarks.large.judgement import judged
from benchmarks.large.peer import motion_of
from benchmarks.large.problems import Large
from benchmarks.large.work import Work, cheapest, markdown, ratio
from ocp import Control, Phase, Problem, State

INTERVALS = 4
# Radau points of degree 3 from the start of an interval on, and its end
PLACES = np.array([0.0, (6 - 6**0.5) / 10, (6 + 6**0.5) / 10, 1.0])


def push() -> Problem:
    """From 1 m and 2 m/s on, the control being the acceleration over 2 s."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("push", {x: v, v: u}, initial={x: 1, v: 2}, end=2)
    return Problem("push", [phase], minimise=phase.integral(u**2) + phase.at_end(x))


def answer(times: np.ndarray) -> dict[str, list]:
    """The motion under u = 3 - 6 t, integrated by hand."""
    state = [1 + 2 * times + 1.5 * times**2 - times**3, 2 + 3 * times - 3 * times**2]
    control = [(3 - 6 * times)[:-1].tolist()]
    return {"time": times.tolist(), "state": [row.tolist() for row in state], "control": control}


def sampled() -> np.ndarray:
    starts = np.linspace(0.0, 2.0, INTERVALS + 1)
    points = (starts[:-1, None] + np.diff(starts)[:, None] * PLACES[:3]).ravel()
    return np.append(points, 2.0)


def test_an_answer_is_the_motion_between_its_points():
    motion = motion_of(push(), [answer(sampled())], INTERVALS)
    at = np.linspace(0.0, 2.0, 23)[:-1]

    # polynomials of as high a degree as the motion's: only rounding is left
    expected = [1 + 2 * at + 1.5 * at**2 - at**3, 2 + 3 * at - 3 * at**2, 3 - 6 * at]
    assert motion.phases[0].sample(at) == pytest.approx(np.array(expected).T, abs=1e-12)


def test_an_answer_is_judged_by_its_objective_and_by_its_replay():
    problem = push()
    large = Large("push", push, 25.0, "")
    exact = answer(sampled())
    motion = motion_of(problem, [exact], INTERVALS)
    assert judged(large, problem, 26.0, motion) == pytest.approx(0.04, rel=1e-9)

    # 0.04 m/s^2 more than the states know of: both end 0.08 off, and their sizes are 2 to 7
    exact["control"] = (np.array(exact["control"]) + 0.04).tolist()
    motion = motion_of(problem, [exact], INTERVALS)
    assert 0.08 / 7 <= judged(large, problem, 25.0, motion) <= 0.08 / 2


def test_the_cheapest_mesh_is_the_one_that_is_right():
    rows = [
        Work("fixed", "20 intervals", 1.0, 5e-3),
        Work("fixed", "40 intervals", 2.0, 5e-4),
        Work("fixed", "80 intervals", 3.0, 5e-5),
        Work("yapss", "40 intervals", 1.5, 5e-4),
        Work("engine", "accuracy=0.001", 4.0, 1e-4, 5e-4),
        Work("engine", "accuracy=0.0001", 9.0, 1e-6, 1e-5),
        Work("engine", "defaults", 30.0, float("nan")),
    ]
    assert cheapest(rows, 1e-3, "fixed") == rows[1]
    assert cheapest(rows, 1e-4, "yapss") is None
    assert [ratio(rows, how) for how in ("accuracy=0.001", "defaults")] == ["2.0", "10.0"]
    assert markdown({"launch": rows}).endswith(
        "| 80 intervals, 3.0 s | none | 4.0 s | 9.0 s | 30 s | 1e-04, 5e-04 |"
    )
