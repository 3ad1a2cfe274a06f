"""Path limits that the end values of a phase break by themselves."""

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Algebraic,
    Bound,
    Constant,
    HomotopyStopped,
    Infeasible,
    Phase,
    Problem,
    Unknown,
    homotopy,
    relaxed,
    solve,
)
from tests.ocp.problems import double_integrator

x, v, a, RATES = double_integrator()


def over(bound, far=1.0):
    """A move from rest to rest within a limit."""
    move = Phase("move", RATES, {x: 0, v: 0}, {x: far, v: 0}, end=1.0, bounds=[bound])
    return Problem("over", move, minimise=move.integral(a**2))


def test_the_tail_of_a_hill_at_the_end_is_told_at_once():
    # two metres from its middle the hill is still 9 cm high
    hill = Bound("hill", 0.0 - 5.0 * ca.exp(-((x - 3.0) ** 2)), "m", lower=0)
    words = (
        r"final values of phase 'move' make 'hill' -0\.0915782 m, which is beyond its limit of 0 m "
        r"by 0\.0915782 m; change the limit"
    )
    with pytest.raises(Infeasible, match=words):
        solve(over(hill))


@pytest.mark.parametrize("size", [1e-6, 1.0, pytest.param(1e6, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("beyond", "told"), [(1e-5, True), (1e-7, True), (1e-9, False)])
def test_an_excess_is_a_part_of_the_size(size, beyond, told):
    problem = over(Bound("square", x**2 / size, "m", upper=size * (1 - beyond)), far=size)
    if told:
        with pytest.raises(Infeasible, match="final values of phase 'move' make 'square'"):
            solve(problem)
    else:
        assert solve(problem).objective == pytest.approx(12.0 * size**2, rel=1e-6)


def test_both_ends_and_the_time_are_told():
    ramp = Bound("ramp", x + TIME, "m", lower=0.5, upper=1.5)
    with pytest.raises(Infeasible, match=r"initial values .* 0 m.* 0\.5 m; the final .* 2 m"):
        solve(over(ramp))


def test_rounding_is_no_excess():
    # the end lies on the limit up to rounding: sin(pi) is 1.2e-16
    on_it = Bound("on it", ca.sin(x), lower=0)
    assert solve(over(on_it, far=np.pi)).objective == pytest.approx(12 * np.pi**2, rel=1e-6)


def test_a_limit_of_what_is_free_is_left_to_the_solver():
    p, y = Unknown("p", "m", lower=0, upper=3), Algebraic("y", "m")
    bounds = [
        Bound("roof", x - p, "m", upper=0),
        Bound("same", y - x, "m", lower=0, upper=0),
        Bound("force", a + x, "m/s^2", upper=20),
        Bound("below", y, "m", upper=1),
    ]
    move = Phase("move", RATES, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0, bounds=bounds)
    found = solve(Problem("free", move, minimise=move.integral(a**2) + p))
    assert found.objective == pytest.approx(13.0, rel=1e-5)


def test_relaxed_says_by_how_much():
    low = over(Bound("roof", x + 0 * v, "m", upper=0.75))
    with pytest.raises(Infeasible, match=r"'roof' 1 m.*beyond its limit of 0\.75 m by 0\.25 m"):
        solve(low)
    (item,) = relaxed(low, only=["move: roof"]).items
    assert item.needed == pytest.approx(1.0, abs=1e-4)


def test_a_homotopy_keeps_what_it_found():
    roof = Constant("height", "m", 1.2)
    problem = over(Bound("roof", x + 0 * v, "m", upper=roof))
    with pytest.raises(HomotopyStopped, match="at height") as told:
        homotopy(problem, roof, [1.1, 0.9], least_step=1 / 4)
    assert 1.0 <= told.value.reached <= 1.1
