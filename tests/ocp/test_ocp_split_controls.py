"""Moduli and largest values of controls in rates: stores with losses."""

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linprog

from ocp import TIME, Constant, Control, Phase, Problem, SolveFailed, State, load, save, solve
from ocp.reformulate.form import reformulated
from ocp.reformulate.standard import STANDARD

HOURS = 24
e = State("energy", "MWh", lower=0, upper=4)
u = Control("power", "MW", lower=-1, upper=1)


def lossy(rate, level):
    """A store at a price per hour around a level [EUR/MWh], its cost and its problem."""
    phase = Phase("day", {e: rate}, {e: 2}, {e: 2}, end=HOURS)
    cost = phase.integral((level + 20 * ca.sin(2 * ca.pi * ca.floor(TIME) / HOURS)) * u)
    return cost, Problem("store", phase, minimise=cost)


def least_cost(level):
    """The least cost by a linear program, with charge and discharge constant in each hour."""
    price = level + 20 * np.sin(2 * np.pi * np.arange(HOURS) / HOURS)
    into = np.tril(np.ones((HOURS, HOURS)))
    stored = np.hstack([0.95 * into, -into / 0.95])
    found = linprog(
        np.concatenate([price, -price]),
        A_ub=np.vstack([stored, -stored]),
        b_ub=np.full(2 * HOURS, 2.0),
        A_eq=stored[-1:],
        b_eq=[0.0],
        bounds=(0, 1),
    )
    assert np.minimum(found.x[:HOURS], found.x[HOURS:]).max() < 1e-9
    return found.fun


# what is charged, however it is written
eta = Constant("efficiency", value=0.95)
RATES = {
    "largest values": 0.95 * ca.fmax(u, 0) - ca.fmax(-u, 0) / 0.95,
    "least value": ca.fmin(0.95 * u, u / 0.95),
    "constant": eta * ca.fmax(u, 0) + ca.fmin(u, 0) / eta,
}


@pytest.mark.parametrize("rate", RATES.values(), ids=RATES)
def test_a_store_with_losses_costs_what_a_linear_program_says(rate):
    cost, problem = lossy(rate, 50)
    found = solve(problem)
    assert least_cost(50) == pytest.approx(-100.902536, abs=1e-6)
    assert found.objective == pytest.approx(least_cost(50), rel=1e-6)
    assert found.value(cost) == pytest.approx(found.objective, rel=1e-9)


def test_the_control_of_the_statement_is_sampled_and_stored(tmp_path):
    rate = RATES["largest values"]
    found = solve(lossy(rate, 50)[1])
    times = np.arange(HOURS) + 0.5
    power = found.sample(u, times)
    assert np.abs(power).max() <= 1.0
    stated = 0.95 * np.maximum(power, 0.0) - np.maximum(-power, 0.0) / 0.95
    assert found.sample(rate, times) == pytest.approx(stated, abs=1e-12)
    save(found, tmp_path / "store")
    assert load(tmp_path / "store").objective == found.objective


def test_the_statement_of_the_user_stays_and_can_be_used_again():
    phase = Phase("day", {e: RATES["largest values"]}, {e: 2}, {e: 2}, end=HOURS)
    bought = phase.integral(u)
    for limit in (1.0, 2.0):
        problem = Problem("store", phase, minimise=bought, bounds=[phase.integral(u**2) <= limit])
        form = reformulated(problem, STANDARD).problem
        assert [control.name for control in form.controls["day"]] == ["power", "|power|"]
    assert [symbol.name for symbol in phase.symbols] == ["energy", "power"]


@pytest.mark.parametrize("level", [-50, 10])
def test_a_price_that_pays_for_losses_is_told(level):
    with pytest.raises(
        SolveFailed, match=r"positive and its negative part at once .* two controls"
    ):
        solve(lossy(RATES["largest values"], level)[1])
