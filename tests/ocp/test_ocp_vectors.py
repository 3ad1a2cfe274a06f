"""Vectors of symbols: stated, bounded, guessed and sampled as one would write them."""

import casadi as ca
import numpy as np
import pytest

from ocp import Control, Phase, Problem, State, Unknown, solve


def turned(q, w):
    """Rate of a quaternion under an angular velocity in the body's axes."""
    return 0.5 * ca.vertcat(
        -q[1] * w[0] - q[2] * w[1] - q[3] * w[2],
        q[0] * w[0] + q[2] * w[2] - q[3] * w[1],
        q[0] * w[1] - q[1] * w[2] + q[3] * w[0],
        q[0] * w[2] + q[1] * w[1] - q[2] * w[0],
    )


def test_an_attitude_turns_by_a_right_angle_with_least_effort():
    q, w = State("attitude", shape=4), State("rate", "rad/s", shape=3)
    torque = Control("torque", "rad/s^2", shape=3, lower=-5, upper=[5, 5, 6])
    end = np.cos(np.pi / 4)
    slew = Phase(
        "slew",
        dynamics={q: turned(q, w), w: torque},
        initial={q: [1, 0, 0, 0], w: 0},
        # the last entry follows from the norm
        final={q[1]: 0, q[2]: 0, q[3]: end, w: [0, 0, 0]},
        end=2.0,
        guess={q: lambda t: np.array([1 + 0 * t, 0 * t, 0 * t, end * t / 2])},
    )
    found = solve(Problem("slew", slew, minimise=slew.integral(ca.sumsqr(torque))))
    # about one axis: 12 (angle)^2 / T^3
    assert found.objective == pytest.approx(12 * (np.pi / 2) ** 2 / 8, rel=1e-8)
    places = found.sample(q, [0.0, 1.0, 2.0])
    assert places.shape == (4, 3)
    np.testing.assert_allclose(
        places[:, 1], [np.cos(np.pi / 8), 0, 0, np.sin(np.pi / 8)], atol=1e-6
    )
    np.testing.assert_allclose(found.sample("attitude[3]", [2.0]), [end], atol=1e-9)


def test_functions_of_casadi_and_relations_take_vectors():
    q, v = State("q", shape=2), State("v", "1/s", shape=2)
    u, k = Control("u", shape=2), Unknown("k", shape=2, lower=0, upper=[1, 2], guess=[0.5, 1])
    a, b = ca.SX.sym("a", 2), ca.SX.sym("b", 2)
    rate = ca.Function("rate", [a, b], [a - 2 * b])
    phase = Phase("p", {q: rate(v, q), v: u}, bounds=[q <= 3, ca.dot(q, v) <= 1], end=1.0)
    assert [bound.name for bound in phase.bounds[:2]] == ["q[0] <= 3", "q[1] <= 3"]
    assert str(phase.dynamics[q[1]]) == "(v[1]-(2.*q[1]))"
    assert (k[0].upper, k[1].upper, k[1].guess) == (1, 2, 1)
    assert repr(q) == "State('q', '1', shape=2)"


def test_pairs_and_tables_of_a_vector():
    q, u = State("q", shape=2), Control("u", shape=2)
    phase = Phase(
        "p",
        {q: u},
        {q: [0, 0]},
        {q: ([1, 2], [3, 4])},
        end=1.0,
        guess={q: ([0, 1], [[0, 0], [2, 3]]), u: [1, 2]},
    )
    assert [phase.final[c] for c in q] == [(1, 3), (2, 4)]
    assert [phase.guess[c] for c in u] == [1, 2]
    assert [phase.guess[c][1].tolist() for c in q] == [[0, 2], [0, 3]]
