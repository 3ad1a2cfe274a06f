"""Every kind of guess gets where it says, and another solution starts a solve on its own mesh."""

import numpy as np
import pytest

from ocp import (
    Constant,
    Control,
    Mesh,
    Phase,
    Problem,
    Settings,
    State,
    Unknown,
    joined,
    solve,
)
from ocp.mesh.initial_guess import guess_by_lines, initial_guess
from ocp.mesh.mesh import PhaseMesh, uniform
from ocp.numerics.schemes import Gauss, HermiteSimpson, Radau
from ocp.problem.parameters import parameters_of
from ocp.scaling.automatic import scales_of
from ocp.transcription.packing import decision_vector, trajectory_of
from ocp.transcription.transcribe import transcribe

START, END = 2.0, 6.0
FRACTIONS = np.linspace(0.0, 1.0, 9)
TIMES = START + FRACTIONS * (END - START)


def guessed(guess, shape="polynomial"):
    x, v = State("x"), State("v", lower=-50, upper=50)
    u, k = Control("u", piecewise=shape), Unknown("k", lower=1, upper=3, guess=2.5)
    named = {"x": x, "v": v, "u": u}
    phase = Phase(
        "move",
        {x: v, v: k * u},
        initial={x: 1.0},
        final={x: 3.0},
        start=START,
        end=END,
        guess={named[name]: value for name, value in guess.items()},
    )
    return Problem("guessed", [phase], minimise=phase.integral(u**2) + k)


def stated(problem):
    return initial_guess(problem, parameters_of(problem))


FORMS = {
    "a number": (4.0, np.full(9, 4.0)),
    "a pair": ((1.0, -3.0), 1 - 4 * FRACTIONS),
    "a function": (lambda t: t**2, TIMES**2),
    "a function of one value": (lambda t: 7.0, np.full(9, 7.0)),
    "a table": (([2.0, 4.0, 6.0], [0.0, 8.0, 4.0]), np.interp(TIMES, [2, 4, 6], [0, 8, 4])),
}


@pytest.mark.parametrize("form", FORMS)
def test_each_form_of_guess(form):
    guess, expected = FORMS[form]
    start = stated(guessed({"v": guess}))
    np.testing.assert_allclose(start.phases["move"].at_fractions(FRACTIONS)["v"], expected)
    assert start.unknowns == {"k": 2.5}


def test_without_a_guess_boundary_values_are_joined():
    values = stated(guessed({})).phases["move"].at_fractions(FRACTIONS)
    np.testing.assert_allclose(values["x"], 1 + 2 * FRACTIONS)
    np.testing.assert_allclose(values["v"], 0.0, atol=0)


@pytest.mark.parametrize("shape", ["linear", "polynomial"])
@pytest.mark.parametrize("scheme", [Radau(), Gauss(), HermiteSimpson()])
def test_a_decision_vector_holds_the_guess(scheme, shape):
    guess = {"x": lambda t: 1 + (t - 2) ** 2 / 8, "v": lambda t: t / 4, "u": (2.0, 5.0)}
    problem = guessed(guess, shape)
    parameters, start = parameters_of(problem), stated(problem)
    degrees = [3, 3, 3] if scheme.fixed_degree else [3, 5, 3]
    mesh = Mesh((PhaseMesh(np.array([0, 0.2, 0.7, 1]), np.array(degrees), (1,)),))
    scales = scales_of(problem, start, parameters)
    made = transcribe(problem, mesh, scheme, "automatic", scales)
    x = decision_vector(made, start, made.limits(parameters), parameters.vector)
    back = trajectory_of(made, x, parameters).phases[0]
    np.testing.assert_allclose(back.breakpoints, [2.0, 2.8, 4.8, 6.0], rtol=1e-14)
    values = back.at_fractions(FRACTIONS)
    # polynomials of the guess lie in the space; controls are read 1e-9 inside their interval
    np.testing.assert_allclose(values["x"], 1 + 2 * FRACTIONS**2, rtol=1e-12)
    np.testing.assert_allclose(values["u"], 2 + 3 * FRACTIONS, rtol=1e-7)


def transfer(end=1.0):
    x, v, u = State("x"), State("v"), Control("u")
    phase = Phase("move", {x: v, v: u - x**3}, initial={x: 0, v: 0}, final={x: 1, v: 0}, end=end)
    return Problem("transfer", [phase], minimise=phase.integral(u**2))


def test_another_solution_on_another_mesh_is_a_good_start():
    problem = transfer()
    first = solve(problem, settings=Settings(intervals=7))
    mesh = Mesh((uniform(11, 5),))
    again = solve(problem, guess=first, mesh=mesh)
    assert again.mesh.phases[0].intervals == 11
    # both optima within the solver's tolerance and the discretisation of a smooth problem
    assert again.objective == pytest.approx(first.objective, rel=1e-7)
    trajectory = solve(problem, guess=first.trajectory)
    assert trajectory.objective == pytest.approx(first.objective, rel=1e-7)
    assert solve(problem, guess=first).mesh.phases[0].intervals == 7  # its own mesh by default


def test_a_motion_that_has_all_signals_leaves_nothing_to_the_stated_guess():
    asked = []

    def watched(times):
        asked.append(times.size)
        return times

    problem = guessed({"v": watched})
    motion = solve(problem).trajectory
    asked.clear()
    guess = initial_guess(problem, parameters_of(problem), motion).phases["move"]
    np.testing.assert_allclose(
        guess.at_fractions(FRACTIONS)["v"], motion.phases[0].at_fractions(FRACTIONS)["v"]
    )
    assert not asked


def test_a_guess_for_another_duration_is_stretched():
    first = solve(transfer(), settings=Settings(intervals=7))
    longer = solve(transfer(2.0), guess=first)
    assert longer.value(longer.problem.phases[0].end_time) == 2.0
    direct = solve(transfer(2.0), settings=Settings(intervals=7))
    assert longer.objective == pytest.approx(direct.objective, rel=1e-7)


DROPPED = Constant("dropped", "kg", 20.0)
HEIGHT, MASS = State("height", "m"), State("mass", "kg", lower=25.0)
THRUST = Control("thrust", "kN", lower=0, upper=30)


def rocket(links, **of_phases):
    """Three stages, of which only the first one states where its states begin."""
    stages = [
        Phase(
            name,
            {HEIGHT: THRUST / MASS, MASS: -0.01 * THRUST},
            {HEIGHT: 3.0, MASS: 100.0} if start == 0.0 else {},
            start=start,
            end=start + 1.0,
            **of_phases.get(name, {}),
        )
        for start, name in enumerate(("lift", "coast", "climb"))
    ]
    return Problem("rocket", stages, maximise=stages[-1].at_end(HEIGHT), links=links(*stages))


def dropping(lift, coast, climb):
    """A tank is dropped after the first stage."""
    return *joined(lift, coast, jump={MASS: MASS - DROPPED}), *joined(coast, climb)


def held(problem, start=stated):
    """The height and the mass that each phase is guessed to hold."""
    phases = start(problem).phases.values()
    values = [phase.at_fractions(np.array([0.0, 1.0])) for phase in phases]
    for value in values:
        assert np.ptp(value["height"]) == np.ptp(value["mass"]) == 0.0
    return [(float(value["height"][0]), float(value["mass"][0])) for value in values]


def test_a_state_without_a_value_has_that_of_the_phase_before():
    assert held(rocket(dropping)) == [(3.0, 100.0)] * 3
    lines = held(rocket(dropping), lambda p: guess_by_lines(p, parameters_of(p)))
    assert lines == [(3.0, 100.0)] * 3


def test_a_value_of_its_own_counts_before_that_of_another_phase():
    heavy = rocket(dropping, coast={"guess": {MASS: 60.0}}, climb={"final": {HEIGHT: 9.0}})
    assert held(heavy) == [(3.0, 100.0), (3.0, 60.0), (9.0, 60.0)]


def test_a_rate_over_a_mass_that_only_the_first_stage_states_has_a_value():
    speed, mass = State("speed", "m/s"), State("mass", "kg")
    thrust, weaker = Control("thrust", "N", lower=0, upper=6), Control("weaker", "N", 0, 1)
    first = Phase(
        "first",
        {speed: thrust / mass, mass: -thrust},
        {speed: 0, mass: 8},
        end=1.0,
        guess={thrust: 3},  # who states something is not helped by other starts
    )
    second = Phase("second", {speed: weaker / mass, mass: -weaker}, start=1.0, end=2.0)
    links = joined(first, second, jump={mass: mass - 0.6})
    found = solve(Problem("stages", (first, second), maximise=second.at_end(speed), links=links))
    # full thrust: ln(8 / 2), then ln(1.4 / 0.4)
    assert found.objective == pytest.approx(np.log(14), rel=1e-8)
