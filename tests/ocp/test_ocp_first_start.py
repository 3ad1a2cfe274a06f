"""Where the stated guess leads nowhere: other barriers, and guesses by simulation."""

from types import SimpleNamespace
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
    Control,
    InvalidNumber,
    Ipopt,
    Phase,
    Problem,
    Settings,
    State,
    joined,
    solve,
)
from ocp.mesh.initial_guess import initial_guess, states_a_motion, states_only_lines
from ocp.mesh.simulated_guess import simulated_guesses
from ocp.nlp.solver import NlpResult
from ocp.problem.parameters import parameters_of
from ocp.refinement.budget import Budget
from ocp.refinement.search import FirstMesh
from tests.ocp.problems import double_integrator, least_effort


def pendulum(end=6.0, least="effort", most=np.inf, **guess):
    """Swung up in 6 s with a torque as large as it likes, or with a small one in the least time."""
    q, w = State("q", "rad"), State("w", "rad/s")
    u = Control("u", "rad/s^2", lower=-most, upper=most)
    swing = Phase(
        "swing",
        dynamics={q: w, w: u - 9.81 * ca.sin(q)},
        initial={q: 0, w: 0},
        final={q: np.pi, w: 0},
        end=end,
        guess={{"q": q, "w": w, "u": u}[name]: value for name, value in guess.items()},
    )
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


@pytest.mark.parametrize("guess", [{}, {"q": 0.0, "w": 0.0, "u": 0.0}])
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
    words = r"the objective has a derivative that is NaN or infinite .*where 'integral' = 0; start"
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


def test_what_answers_took_tells_how_long_a_start_is_waited_for():
    waited = []

    def run(program, solver, point, limits, number):
        waited.append(solver.max_iterations)
        nothing = np.zeros(0)
        return NlpResult("solved", "", nothing, 1.0, nothing, nothing, nothing, 40, 0.0)

    meshes = SimpleNamespace(budget=Budget(), limits=lambda program: None, run=run)
    first_mesh = FirstMesh(meshes, Ipopt(), ())
    done = run(None, Ipopt(), None, None, 1)
    attempts = [(Ipopt(), None)] * 5
    taken = list(first_mesh.runs(None, attempts, done, agreed=lambda answers: len(answers) > 2))
    assert waited[1:] == [300, 200, 200, 80, 80]
    assert taken[-1].iterations == 6 * 40


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


@pytest.mark.parametrize(("force", "near"), [(1.2, 4), (4e4, 0)])
def test_simulated_guesses_keep_near_their_path_constraints(force, near):
    """With 40 kN each draw is far beyond a speed of 1 m/s at once, and left out."""
    x, v = State("x", "m", scale=1.0), State("v", "m/s", scale=1.0)
    f = Control("f", "N", lower=-force, upper=force)
    slow = Bound("slow", v * ca.cosh(x / 100), lower=-1.0, upper=1.0, scale=1.0)
    ride = Phase("ride", {x: v, v: f - v}, {x: 0, v: 0}, {x: 1}, end=Between(0.1, 9), bounds=[slow])
    problem = Problem("ride", ride, minimise=ride.duration)
    sizes, bounds = {"x": 1.0, "v": 1.0, "f": force}, {("ride", "slow"): 1.0}
    guesses = simulated(problem, sizes, bounds, 4, 10.0)
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
        swing = Phase(
            "swing",
            {q: w, w: u - 9.81 * ca.sin(q) - 0.01 * rod * w},
            {q: 0, w: 0},
            {q: np.pi, w: 0},
            end=Between(0.5, 10),
            bounds=bounds,
        )
        return solve(Problem("pendulum", swing, minimise=swing.end_time)).objective

    by_equation = least(rod, [Bound("balance", rod - force, lower=0, upper=0)])
    assert by_equation == pytest.approx(least(force, []), rel=1e-6)


def test_the_monotone_barrier_is_tried_where_the_adaptive_one_ends_without_an_answer():
    # one iteration is never enough; the attempts after a run this short are not made
    with pytest.raises(Exception, match="used up its budget of iterations or seconds after 1 "):
        solve(swing_up(), settings=Settings(solver=Ipopt(max_iterations=1)))


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
