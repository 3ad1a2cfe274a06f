"""The one verifier of all contestants: it lets the closed form pass and names what is wrong."""

import dataclasses
import math

import numpy as np
import pytest

from benchmarks.race.rows import problems
from benchmarks.race.rows.problems import DURATION, END, JERK_CAP, START
from benchmarks.race.verifier import OPTIMUM, judge
from models.laws import JerkLimited
from models.truss import DYNAMIC_SET, rope_force


def best_control():
    """The optimum of A in closed form."""
    profile = JerkLimited(DURATION["A"], START, END, JERK_CAP["A"]).profile
    return {
        "edges": profile.edges,
        "nodes": (0.5,),
        "jerk": [[jerk] for _, jerk, _ in profile.rates],
    }


def test_the_closed_form_is_right():
    found = judge("A", best_control())
    assert found.right
    assert abs(found.miss) < 1e-12  # four orders above rounding
    assert abs(found.peak_error) < 1e-6  # the optimum is printed with seven digits
    assert found.reason == ""


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda c: c | {"jerk": 1.002 * np.array(c["jerk"])}, "jerk exceeded by 0.2 %"),
        (lambda c: c | {"edges": np.array(c["edges"]) - np.eye(6)[2] * 1e-2}, "rad off"),
        (lambda c: c | {"nodes": (0, 1), "jerk": np.array(c["jerk"]) * [[1.0, 0.9]]}, "peak"),
    ],
)
def test_what_is_wrong_is_named(change, words):
    found = judge("A", change(best_control()))
    assert not found.right
    assert words in found.reason


def test_a_motion_of_another_duration_is_refused():
    control = best_control()
    with pytest.raises(ValueError, match=r"lasts 140.01 s, not 140 s"):
        judge("A", control | {"edges": [*control["edges"][:-1], 140.01]})


def test_the_force_between_the_nodes_counts():
    duration = DURATION["B"]
    jerk = 64 * (END - START) / duration**3 / 2  # bang-bang: up, down, up
    quarters = duration * np.array([0, 0.25, 0.75, 1])
    found = judge("B", {"edges": quarters, "nodes": (0.5,), "jerk": [[jerk], [-jerk], [jerk]]})
    assert abs(found.miss) < 1e-12
    assert not found.right
    assert found.peak > 2 * OPTIMUM["B"]


def test_the_force_of_the_contestants_is_that_of_the_models():
    truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=problems.PULLEY)
    for angle in np.linspace(START, END, 7):
        for omega, acc in ((0.0, 0.0), (0.3, 0.0), (0.2, -0.4)):
            ours = float(rope_force(truss, angle, omega, acc))
            theirs = problems.rope_force(np, np.where, angle, omega, acc)
            assert theirs == pytest.approx(ours, rel=1e-11)  # the constants have 15 digits
    assert math.degrees(START) == pytest.approx(4.4)
