"""More jumps than a mesh resolves, and programs too large for finer controls."""

import math
import re

import casadi as ca
import pytest

from ocp import TIME, AdaptiveMesh, Control, Phase, Problem, Settings, State, certify, solve

WAVES = 13  # the control switches 25 times
INTERVALS = 40


def waves():
    """A force that follows a wave of thirteen periods; the optimum is -2/pi."""
    x, u = State("x", "m"), Control("u", "m/s", lower=-1, upper=1)
    phase = Phase("run", {x: u}, {x: 0}, end=1.0)
    rate = 2 * math.pi * WAVES
    # by parts the integral of u sin(rate t)
    return Problem("waves", [phase], minimise=phase.integral(-rate * x * ca.cos(rate * TIME)))


def test_a_mesh_with_too_many_jumps_is_made_finer_before_they_are_bracketed():
    found = solve(waves(), settings=Settings(intervals=INTERVALS))
    first, second, *later = found.mesh_iterations
    assert first.intervals < second.intervals <= 2 * first.intervals
    assert second.movable == 0
    assert any(entry.movable for entry in later)
    assert found.objective == pytest.approx(-2 / math.pi, rel=1e-6)
    assert certify(found).passed


def test_controls_are_not_refined_beyond_the_unknowns_allowed():
    few = AdaptiveMesh(most_unknowns=300)
    found = solve(waves(), settings=Settings(intervals=INTERVALS, refinement=few))
    assert found.verification.passed
    assert "finer controls may improve it by" in found.verdict
    # the promise is of first order, and has one digit there
    (digit,) = re.findall(r"may improve it by (\S+);", found.verdict)
    promised = 1.2 * float(digit)
    assert -2 / math.pi < found.objective < (1 - promised) * -2 / math.pi
