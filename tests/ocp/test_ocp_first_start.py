"""Where a solve starts: stated guesses, other solutions, other barriers, guesses by simulation."""

from typing import ClassVar

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Accuracy,
    Algebraic,
    Between,
    Bound,
    ByFraction,
    Constant,
    Control,
    InvalidNumber,
    Ipopt,
    Mesh,
    Phase,
    Problem,
    Settings,
    State,
    Unknown,
    joined,
    solve,
)
from ocp.mesh.initial_guess import (
    guess_by_lines,
    initial_guess,
    states_a_motion,
    states_only_lines,
)
from ocp.mesh.mesh import PhaseMesh, uniform
from ocp.mesh.simulated_guess import simulated_guesses
from ocp.numerics.schemes import Gauss, HermiteSimpson, Radau
from ocp.problem.parameters import parameters_of
from ocp.scaling.automatic import scales_of
from ocp.transcription.packing import decision_vector, trajectory_of
from ocp.transcription.transcribe import transcribe
from tests.ocp.problems import double_integrator, least_effort


def pendulum(end=6.0, least="effort", most=np.inf, **guess):
    """Swung up in 6 s with a torque as large as it likes, or with a small one in the least time."""
    q, w = State("q", "rad"), State("w", "rad/s")
    u = Control("u", "rad/s^2", lower=-most, upper=most)
    named = {"q": q, "w": w, "u": u}
    given = {named[name]: value for name, value in guess.items()}
    rates = {q: w, w: u - 9.81 * ca.sin(q)}
    swing = Phase("swing", rates, {q: 0, w: 0}, {q: np.pi, w: 0}, end=end, guess=given)
    cost = swing.integral(u**2) if least == "effort" else swing.end_time
    return Problem("pendulum", swing, minimise=cost)


def swing_up(**guess):
    """A torque of a fifth of the weight's swings it up in the least time."""
    return pendulum(Between(0.5, 10), "time", 2.0, **guess)


def simulated(problem, sizes, bounds=None, count=4, *further):
    """Guesses by simulation, from the same random numbers each time."""
    parameters = parameters_of(problem)
    stated, random = initial_guess(problem, parameters), np.random.default_rng(0)
    return simulated_guesses(
        problem, parameters, stated, sizes, bounds or {}, count, random, *further
    )


@pytest.mark.parametrize(
    "guess", [{}, pytest.param({"q": 0.0, "w": 0.0, "u": 0.0}, marks=pytest.mark.slow)]
)
def test_a_pendulum_is_swung_up_from_a_straight_line_and_from_none(guess):
    solution = solve(swing_up(**guess))
    # found by every one of many starts, and by a mesh of 400 intervals; four digits are pinned
    assert solution.objective == pytest.approx(5.7006, abs=5e-5)
    assert solution.verification.passed


@pytest.mark.parametrize(
    "guess",
    [
        {},
        {"q": 0.0, "w": 0.0, "u": 0.0},
        {"q": np.zeros_like, "w": 0.0},
        {"q": ByFraction(lambda s: [0.0 for _ in s])},
        {"q": ([0.0, 6.0], [0.0, 0.0])},
    ],
)
def test_what_states_no_motion_is_held_against_other_starts(guess):
    # the lowest optimum that any of 20 starts finds on 120 intervals of a plain collocation
    solution = solve(pendulum(**guess))
    assert solution.objective == pytest.approx(15.97568, rel=1e-6)
    # one answer alone would be no reason to stop
    starts = solution.mesh_iterations[0].starts
    assert starts >= 2
    assert solution.verdict == f"local: best of {starts} starts; not confirmed (ocp.certify)"


def test_a_long_way_from_a_straight_line_says_as_little_as_no_guess(monkeypatch):
    line = pendulum(q=(0.0, np.pi), w=0.0, u=0.0)
    monkeypatch.setattr("ocp.refinement.first_start._ROUND_ABOUT", 5)
    solution = solve(line)
    assert solution.objective == pytest.approx(15.97568, rel=1e-6)
    assert solution.mesh_iterations[0].starts > 1


def test_a_guess_that_bends_is_no_straight_line():
    bent = pendulum(q=lambda t: np.pi * (t / 6) ** 2)
    assert not states_only_lines(bent, parameters_of(bent))
    line = pendulum(q=lambda t: np.pi * t / 6, w=np.pi / 6)
    assert states_only_lines(line, parameters_of(line))
    assert states_a_motion(line, parameters_of(line))


def test_where_answers_of_one_mesh_are_no_motions_the_search_goes_on_on_a_finer_one():
    # two intervals are too few for three swings: their best values belong to no motion
    solution = solve(pendulum(), settings=Settings(intervals=2))
    assert solution.mesh_iterations[0].intervals >= 8
    assert solution.objective == pytest.approx(15.97568, rel=1e-6)


def test_a_search_leaves_most_of_a_budget_to_the_refinement():
    # the stated guess takes 17 iterations, two more starts about 25
    free = solve(pendulum())
    tight = solve(pendulum(), settings=Settings(iterations=100))
    assert tight.mesh_iterations[0].starts < free.mesh_iterations[0].starts
    assert tight.mesh_iterations[0].iterations < 60
    assert tight.verification.passed


def root_of_the_effort(duration, **guess):
    """A metre from rest to rest with the least root of the effort, which has no slope at none."""
    x, v, u, rates = double_integrator()
    signals = {"x": x, "u": u}
    stated = {signals[name]: value for name, value in guess.items()}
    phase = Phase("move", rates, {x: 0, v: 0}, {x: 1, v: 0}, end=duration, guess=stated)
    return Problem("root", phase, minimise=ca.sqrt(phase.integral(u**2)))


@pytest.mark.parametrize("duration", [1.0, 2.0])
def test_a_slope_that_is_infinite_at_no_guess_is_left_by_other_starts(duration):
    solution = solve(root_of_the_effort(duration))
    # the least effort is 12 / T^3
    assert solution.objective == pytest.approx(np.sqrt(12 / duration**3), rel=1e-8)
    first = solution.mesh_iterations[0]
    assert first.lost >= 1  # the guess itself among them
    answers = first.starts - first.lost
    assert answers > 1
    counted = f"local: best of {answers} starts ({first.lost} more failed)"
    assert solution.verdict == f"{counted}; not confirmed (ocp.certify)"


def test_a_motion_of_the_user_with_an_infinite_slope_is_answered_with_its_expression():
    words = r"the objective has a derivative that is NaN or infinite .*where 'integral' = 0; give"
    with pytest.raises(InvalidNumber, match=words):
        solve(root_of_the_effort(1.0, x=(0, 1), u=0.0))


def test_no_more_than_a_few_starts_are_made_where_an_expression_has_no_value_anywhere():
    class Counting(Ipopt):
        """IPOPT that counts its runs."""

        runs: ClassVar[list[str]] = []

        def solve(self, *arguments, **options):
            result = super().solve(*arguments, **options)
            self.runs.append(result.outcome)
            return result

    x, u = State("x", "m"), Control("u", "m/s")
    phase = Phase("move", {x: u}, {x: 0}, {x: 1}, end=1.0)
    problem = Problem("no root", phase, minimise=phase.integral(u**2 + ca.sqrt(-1 - x**2)))
    with pytest.raises(InvalidNumber, match=r"integrand of 'integral' .* NaN .*x = 0 m"):
        solve(problem, settings=Settings(solver=Counting()))
    # the stated guess and three others
    assert Counting.runs == ["invalid number"] * 4


def test_a_start_that_only_confirms_is_given_up_sooner(monkeypatch):
    # the time is free, so that other starts are made; all of them lead to the same answer
    x, u = State("x"), Control("u", lower=-1, upper=1)
    phase = Phase("p", {x: u}, {x: 0}, {x: 1}, end=Between(0.1, 10))
    runs, run = [], Ipopt.solve

    def noted(self, *arguments):
        result = run(self, *arguments)
        runs.append((self.max_iterations, result.outcome, result.iterations))
        return result

    monkeypatch.setattr(Ipopt, "solve", noted)
    solution = solve(Problem("least time", phase, minimise=phase.end_time))
    assert solution.objective == pytest.approx(1.0)
    assert solution.mesh_iterations[0].starts == 6

    starts = runs[:6]
    assert {outcome for _, outcome, _ in starts} == {"solved"}
    assert max(iterations for *_, iterations in starts) <= 15
    # the guess, the first start, which agrees with it, and those that confirm the two
    assert [most for most, *_ in starts] == [1000, 300, 30, 30, 30, 30]


@pytest.mark.parametrize(("tolerance", "starts"), [(1e-6, 25), (0.1, 6)])
def test_answers_within_the_tolerance_on_the_objective_are_one(tolerance, starts):
    """Forty valleys, all within 4 % of the best one, and most starts end in one of their own."""
    x, u = State("x", "m", lower=-5, upper=5), Control("u", "m/s", lower=-5, upper=5)
    walk = Phase("walk", {x: u}, {x: 0.3}, end=1.0)
    last = walk.at_end(x)
    height = 1 + 1e-3 * ca.cos(25 * last) + 1e-3 * (last - 1) ** 2
    problem = Problem("ripples", walk, minimise=height + 1e-6 * walk.integral(u**2))
    found = solve(problem, settings=Settings(accuracy=Accuracy(objective=tolerance)))
    assert found.mesh_iterations[0].starts == starts
    assert found.objective == pytest.approx(0.999, rel=tolerance + 2e-5)


def test_a_straight_line_as_a_guess_stays_the_users_choice():
    # it leads to another optimum than the lowest one
    line = pendulum(q=(0.0, np.pi), w=0.0, u=0.0)
    assert solve(line).objective == pytest.approx(24.27303, rel=1e-6)


def test_linear_rates_need_no_other_starts(monkeypatch):
    def refused(*arguments):
        raise AssertionError("nothing is to be simulated")

    monkeypatch.setattr("ocp.mesh.simulated_guess.simulated_guesses", refused)
    x, v, u, _ = double_integrator()
    move = Phase("move", {x: v, v: u - 0.1 * v}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0)
    assert solve(Problem("line", move, minimise=move.integral(u**2))).verification.passed


def test_simulated_guesses_obey_the_dynamics_and_come_close():
    sizes = {"q": 3.0, "w": 6.0, "u": 2.0}
    first, again = (simulated(swing_up(), sizes) for _ in range(2))
    assert len(first) == 4
    at = np.linspace(0, 1, 2001)
    for guess, same in zip(first, again, strict=True):
        phase = guess.phases["swing"]
        values = phase.at_fractions(at)
        assert 0.5 <= phase.end <= 10
        assert np.abs(values["u"]).max() <= 2
        # one of 512 draws misses by less than the whole way, and much less than a straight line
        assert abs(values["q"][-1] - np.pi) < 1.5
        # the states follow the rate: trapezoidal sums of interpolated values, not the integrator
        turned = np.concatenate([[0], np.cumsum(0.5 * (values["w"][1:] + values["w"][:-1]))])
        assert values["q"] == pytest.approx(turned * phase.end / 2000, abs=0.02)
        assert np.array_equal(values["q"], same.phases["swing"].at_fractions(at)["q"])


@pytest.mark.parametrize(
    ("force", "most", "near"), [(1.2, 10.0, 4), (4e4, 10.0, 0), (1.2, 1e-9, 0)]
)
def test_simulated_guesses_keep_near_their_path_constraints(force, most, near):
    """With 40 kN each draw is far beyond a speed of 1 m/s at once; none ends within 1 nm."""
    x, v = State("x", "m", scale=1.0), State("v", "m/s", scale=1.0)
    f = Control("f", "N", lower=-force, upper=force)
    slow = Bound("slow", v * ca.cosh(x / 100), lower=-1.0, upper=1.0, scale=1.0)
    ride = Phase("ride", {x: v, v: f - v}, {x: 0, v: 0}, {x: 1}, end=Between(0.1, 9), bounds=[slow])
    problem = Problem("ride", ride, minimise=ride.duration)
    sizes, bounds = {"x": 1.0, "v": 1.0, "f": force}, {("ride", "slow"): 1.0}
    guesses = simulated(problem, sizes, bounds, 4, most)
    assert len(guesses) == near
    for guess in guesses:
        values = guess.phases["ride"].at_fractions(np.linspace(0, 1, 161))
        assert max(abs(values["v"]) * np.cosh(values["x"] / 100)) <= 1.05


@pytest.mark.parametrize("final", [None, 1, 3])
def test_simulated_guesses_go_on_in_the_next_phase_where_the_one_before_ended(final):
    x, v, u, rates = double_integrator(lower=-1, upper=1)
    target = {} if final is None else {x: final, v: 0}
    phases = [
        Phase("first", rates, {x: 0, v: 0}, end=1.0),
        Phase("second", rates, final=target, start=1.0, end=3.0),
    ]
    effort = sum(phase.integral(u**2) for phase in phases)
    problem = Problem("two phases", phases, minimise=effort, links=joined(*phases))
    guesses = simulated(problem, {"x": 3.0, "v": 1.0, "u": 1.0})
    assert len(guesses) == 4
    for guess in guesses:
        before, after = (guess.phases[phase.name] for phase in phases)
        for name in ("x", "v"):
            end, begin = before.at_fractions(np.ones(1)), after.at_fractions(np.zeros(1))
            # the first phase has no target: every draw lasts as long as it does
            assert begin[name] == pytest.approx(end[name], abs=1e-12)


def test_a_phase_with_algebraic_signals_is_not_simulated():
    x, z = State("x"), Algebraic("z")
    equation = Bound("e", z - x, lower=1, upper=1)
    phase = Phase("a", {x: z}, {x: 0}, end=1.0, bounds=[equation])
    problem = Problem("dae", phase, minimise=phase.at_end(x))
    assert simulated(problem, {"x": 1, "z": 1}, {("a", "e"): 1.0}) == []


@pytest.mark.slow
def test_a_pendulum_with_the_force_of_its_rod_as_an_equation_is_swung_up():
    # the bearing's friction grows with that force; by substitution the same problem has no equation
    q, w, u = State("q", "rad"), State("w", "rad/s"), Control("u", "rad/s^2", lower=-2, upper=2)
    rod = Algebraic("rod", "m/s^2")
    force = w**2 + 9.81 * ca.cos(q)

    def least(rod, bounds):
        rates, end = {q: w, w: u - 9.81 * ca.sin(q) - 0.01 * rod * w}, Between(0.5, 10)
        swing = Phase("swing", rates, {q: 0, w: 0}, {q: np.pi, w: 0}, end=end, bounds=bounds)
        return solve(Problem("pendulum", swing, minimise=swing.end_time)).objective

    by_equation = least(rod, [Bound("balance", rod - force, lower=0, upper=0)])
    assert by_equation == pytest.approx(least(force, []), rel=1e-6)


def test_a_finer_mesh_is_tried_where_controls_of_few_pieces_have_no_way():
    # 2 m from rest to rest at 1 m/s^2 either way take 2 sqrt(2) s. A line across the middle third
    # of the time takes 1.9 % longer, so that no motion of three linear pieces is as fast as this
    end = 2 * np.sqrt(2) * 1.01
    problem = least_effort(2.0, end, lower=-1, upper=1)
    solution = solve(problem, settings=Settings(intervals=3))
    first = solution.mesh_iterations[0]
    assert first.intervals == 12
    # bang, a ramp through zero of half length h, bang: T^2/4 - h^2/3 = 2, effort T - 4 h/3
    ramp = np.sqrt(3 * (end**2 / 4 - 2))
    assert solution.objective == pytest.approx(end - 4 * ramp / 3, rel=1e-5)


@pytest.mark.parametrize("first", [2.0, 6.0])
def test_a_failure_on_motions_that_end_before_they_begin_says_nothing(first):
    """Of two free times the end may come first: on its way there the solver fails from 2 s."""
    x, u = State("x"), Control("u")
    times = {"start": Between(0, 20, first), "end": Between(0.5, 25, first + 2)}
    move = Phase("move", {x: u}, {x: 0}, {x: 1}, **times)
    longest = Bound("longest", move.duration, upper=2)
    cost = move.integral((1 + (TIME - 7) ** 2) * u**2)
    found = solve(Problem("cheap times", move, minimise=cost, bounds=[longest]))
    # between 6 s and 8 s it is least
    assert found.objective == pytest.approx(1 / (2 * np.arctan(1.0)), rel=1e-7)


START, END = 2.0, 6.0
FRACTIONS = np.linspace(0.0, 1.0, 9)
TIMES = START + FRACTIONS * (END - START)


def guessed(guess, shape="polynomial"):
    x, v = State("x"), State("v", lower=-50, upper=50)
    u, k = Control("u", piecewise=shape), Unknown("k", lower=1, upper=3, guess=2.5)
    named = {"x": x, "v": v, "u": u}
    given = {named[name]: value for name, value in guess.items()}
    rates = {x: v, v: k * u}
    phase = Phase("move", rates, {x: 1.0}, {x: 3.0}, start=START, end=END, guess=given)
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
    x, v, u, _ = double_integrator()
    phase = Phase("move", {x: v, v: u - x**3}, {x: 0, v: 0}, {x: 1, v: 0}, end=end)
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
    guess = {thrust: 3}  # who states something is not helped by other starts
    rates = {speed: thrust / mass, mass: -thrust}
    first = Phase("first", rates, {speed: 0, mass: 8}, end=1.0, guess=guess)
    second = Phase("second", {speed: weaker / mass, mass: -weaker}, start=1.0, end=2.0)
    links = joined(first, second, jump={mass: mass - 0.6})
    found = solve(Problem("stages", (first, second), maximise=second.at_end(speed), links=links))
    # full thrust: ln(8 / 2), then ln(1.4 / 0.4)
    assert found.objective == pytest.approx(np.log(14), rel=1e-8)
