"""Controls on chains of integrators are recognised, and then integrated exactly."""

import casadi as ca
import numpy as np
import pytest

from ocp import Constant, Control, Phase, Problem, Settings, State, solve
from ocp.chains import chain_length, shape_of


def phase(rates):
    return Phase("p", rates, {}, {}, start=0, end=1)


def test_lengths_of_chains():
    x, v, a, u, w = State("x"), State("v"), State("a"), Control("u"), Control("w")
    gain = Constant("gain", value=2.0)
    assert chain_length(phase({x: v, v: a, a: u}), u) == 3
    assert chain_length(phase({a: 3 * u.symbol + 1, v: -2 * a.symbol, x: v}), u) == 3
    assert chain_length(phase({x: v, v: ca.sin(x) + u}), u) == 0
    assert chain_length(phase({x: ca.cos(v), v: u}), u) == 1
    assert chain_length(phase({x: v, v: u, a: u}), u) == 0  # acts on two states
    assert chain_length(phase({x: v, v: u + w}), u) == 0
    assert chain_length(phase({x: v, v: gain * u}), u) == 2
    assert chain_length(phase({x: v, v: u * u}), u) == 0


def test_automatic_is_linear_only_where_that_is_exact():
    x, v, a, u = State("x"), State("v"), State("a"), Control("u")
    p = phase({x: v, v: a, a: u})
    assert shape_of(u, p, "automatic", "radau", 4) == "linear"
    assert shape_of(u, p, "automatic", "radau", 3) == "polynomial"
    assert shape_of(u, p, "automatic", "trapezoid", 2) == "polynomial"
    assert shape_of(u, p, "constant", "radau", 4) == "constant"
    stated = Control("u", shape="polynomial")
    assert shape_of(stated, phase({x: v, v: stated}), "linear", "radau", 4) == "polynomial"


@pytest.mark.parametrize("scheme", ["radau", "gauss", "lobatto"])
def test_the_chain_is_integrated_without_error_on_any_mesh(scheme):
    x, v, a, u = State("x"), State("v"), State("a"), Control("u", lower=-60, upper=60)
    move = Phase("move", {x: v, v: a, a: u}, {x: 0, v: 0, a: 0}, {x: 1, v: 0, a: 0}, end=1)
    found = solve(
        Problem("jerk", [move], minimise=move.integral(u**2)),
        settings=Settings(scheme=scheme, intervals=7, refine=False),
    )
    assert max(r.dynamics_error for r in found.record) <= 1e-12
    # u = 60 - 360 t + 360 t^2 costs 720; a linear control on 7 intervals costs a little more
    assert 720 <= found.objective <= 720 * 1.01
    ends = np.array([found.sample(s, [1.0])[0] for s in (x, v, a)])
    np.testing.assert_allclose(ends, [1, 0, 0], atol=1e-9)
