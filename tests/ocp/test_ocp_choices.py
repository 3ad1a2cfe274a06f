"""Choices between two values that meet: the larger or the lesser of them, and nothing else."""

import casadi as ca
import numpy as np
import pytest

from ocp.problem.kinks.choices import with_larger_ones

force, speed = ca.SX.sym("force"), ca.SX.sym("speed")
power = force * speed


def operations(expression):
    function = ca.Function("f", [force, speed], [expression])
    return {function.instruction_id(k) for k in range(function.n_instructions())}


def same_everywhere(one, other):
    random = np.random.default_rng(1)
    points = [*random.normal(scale=3.0, size=(200, 2)), (0.0, 0.0), (0.0, 1.0), (1.0, 0.0)]
    both = ca.Function("both", [force, speed], [one, other])
    return all(float(a) == pytest.approx(float(b), abs=1e-12) for a, b in map(both.call, points))


@pytest.mark.parametrize(
    ("stated", "operation"),
    [
        (ca.if_else(power > 0, power, 0), ca.OP_FMAX),
        (ca.if_else(power <= 0, 0, power), ca.OP_FMAX),
        (ca.if_else(power < 0, 0, power), ca.OP_FMAX),
        (ca.if_else(power > 0, 0, power), ca.OP_FMIN),
        (ca.if_else(power >= 0, power / 0.8, 0.6 * power), ca.OP_FMAX),
        (ca.if_else(force > 0, force, -force), ca.OP_FMAX),
        (ca.if_else(force > 2, 3 * (force - 2), 0) + speed**2, ca.OP_FMAX),
        (power * (power > 0), ca.OP_FMAX),
        (power * (power > 0) + 3 * power * (power <= 0), ca.OP_FMIN),
        (ca.if_else(force > speed**2, force + speed, speed + speed**2), ca.OP_FMAX),
    ],
    ids=str,
)
def test_two_values_that_meet_are_the_larger_or_the_lesser(stated, operation):
    written = with_larger_ones(stated, [force, speed])
    assert operation in operations(written)
    assert ca.OP_IF_ELSE_ZERO not in operations(written)
    assert same_everywhere(written, stated)


@pytest.mark.parametrize(
    "stated",
    [
        ca.if_else(force > 1, force, 0),
        ca.if_else(force > 0, power, 0),
        ca.if_else(force > 0, force**2, 0),
        ca.if_else(force > 0, force + ca.fmax(0, force - 1e6), 0),
        ca.if_else(force > 0, 1, 0),
        ca.if_else(ca.logic_and(force > 0, speed > 0), power, 0),
        ca.if_else(force > 0, force, 0) + ca.if_else(speed > 0, speed, 0) ** 2,
    ],
    ids=str,
)
def test_any_other_choice_stays_as_it_is(stated):
    written = with_larger_ones(stated, [force, speed])
    assert ca.OP_IF_ELSE_ZERO in operations(written)
    assert same_everywhere(written, stated)


def test_a_signal_that_is_never_negative_may_be_a_factor():
    stated = ca.if_else(force > 0, power, 0)
    written = with_larger_ones(stated, [force, speed], [1])
    assert ca.OP_FMAX in operations(written)
    both = ca.Function("both", [force, speed], [stated, written])
    assert all(float(a) == float(b) for a, b in (both(f, 2.0) for f in (-3.0, 0.0, 3.0)))


def test_values_that_are_real_for_some_numbers_only():
    stated = ca.if_else(ca.sqrt(force) > speed, ca.sqrt(force), speed)
    assert ca.OP_FMAX in operations(with_larger_ones(stated, [force, speed]))


def test_without_a_comparison_nothing_is_made_anew():
    stated = ca.fmax(power, 0)
    assert with_larger_ones(stated, [force, speed]) is stated
