"""What a user writes around the engine, with public names only: parts of one's own, and loops."""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ocp import (
    Between,
    Constant,
    Control,
    Evidence,
    Finding,
    Interpolant,
    Ipopt,
    Mesh,
    MeshPolicy,
    NlpResult,
    NlpSolver,
    Phase,
    PhaseMesh,
    Problem,
    Radau,
    Reformulation,
    Restated,
    Settings,
    State,
    StatementError,
    StatementWarning,
    Unverified,
    certify,
    corrected,
    front,
    load,
    prepare,
    save,
    solve,
)

x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
goal, rest = Constant("goal", "m", 1.0), Constant("rest", "m/s", 0.0)
move = Phase("move", {x: v, v: u}, initial={x: 0, v: 0}, final={x: goal, v: rest}, end=1.0)
effort = Problem("effort", move, minimise=move.integral(u**2))  # least: 12 goal^2


# ----- the four interfaces


class InMillimetres:
    """A reformulation: the place is solved for in millimetres."""

    def apply(self, problem: Problem) -> Restated | None:
        """The same move in millimetres."""
        if x not in problem.phases[0].states:
            return None
        y = State("y", "mm")
        short = Phase(
            "move", {y: 1e3 * v, v: u}, {y: 0, v: 0}, {y: 1e3 * goal.symbol, v: rest}, end=1.0
        )
        solved = Problem("millimetres", short, minimise=short.integral(u**2))
        return Restated(solved, back={x: y / 1e3}, forth={y: 1e3 * x})


def test_a_reformulation() -> None:
    assert isinstance(InMillimetres(), Reformulation)
    found = solve(effort, settings=Settings(reformulations=(InMillimetres(),)))
    assert found.objective == pytest.approx(12.0, rel=1e-8)
    assert found.sample(x, 0.5) == pytest.approx(0.5, rel=1e-8)  # in metres, as it was stated


@dataclass(frozen=True)
class Halving:
    """A mesh policy: every interval in two, until the dynamics hold."""

    rounds: int = 8
    highest_degree: int = 2
    adapts: bool = True

    def next_mesh(self, solved, accuracy) -> Mesh | None:
        """Twice as many intervals."""
        last = solved[-1]
        if last.errors.dynamics <= accuracy.dynamics:
            return None
        (phase,) = last.iterate.mesh.phases
        return Mesh((PhaseMesh(np.linspace(0.0, 1.0, 2 * phase.intervals + 1), 2),))

    def after_failure(self, solved, failed, accuracy) -> None:
        """No other mesh."""


def test_a_mesh_policy() -> None:
    y, w = State("y"), Control("w")
    decay = Phase("decay", {y: -(y**3) + w}, {y: 1}, {y: 0.5}, end=1.0)
    problem = Problem("decay", decay, minimise=decay.integral(w**2))
    policy = Halving()
    assert isinstance(policy, MeshPolicy)
    found = solve(problem, settings=Settings(scheme=Radau(2), intervals=4, refinement=policy))
    counts = [entry.intervals for entry in found.mesh_iterations]
    assert sorted(set(counts)) == [4 * 2**k for k in range(len(set(counts)))]
    assert len(counts) > 2
    assert found.objective == pytest.approx(solve(problem).objective, rel=1e-6)


@dataclass(frozen=True)
class OneNewtonStep:
    """A solver: exact for a quadratic objective under linear equations, and for nothing else."""

    def solve(self, program, start, limits, parameters, listener=None) -> NlpResult:
        """The stationary point, with its multipliers."""
        low, high = limits.columns
        held = np.flatnonzero(low == high)
        at = np.where(low == high, low, 0.0)
        no_multipliers = np.zeros(program.rows)

        upper = program.lagrangian_hessian(at, parameters, 1.0, no_multipliers).full()
        hessian = upper + np.triu(upper, 1).T
        gradient = program.objective_gradient(at, parameters)[1].full().ravel()
        rows = program.oracle(at, parameters)[1].full()
        jacobian = program.constraint_jacobian(at, parameters)[1].full()
        equations = np.vstack([jacobian, np.eye(len(at))[held]])
        wanted = np.concatenate([limits.rows[0] - rows.ravel(), 0.0 * at[held]])

        # stationary, and on all equations
        none = np.zeros((len(equations), len(equations)))
        newton = np.block([[hessian, equations.T], [equations, none]])
        step = np.linalg.lstsq(newton, np.concatenate([-gradient, wanted]))[0]
        found, of_rows, of_held = np.split(step, [len(at), len(at) + program.rows])

        bounds = np.zeros(len(at))
        bounds[held] = of_held
        point = at + found
        objective, rows = program.oracle(point, parameters)
        return NlpResult(
            outcome="solved",
            status="one step",
            x=point,
            objective=float(objective),
            rows=rows.full().ravel(),
            bound_multipliers=bounds,
            row_multipliers=of_rows,
            iterations=1,
            seconds=0.0,
            solver="one Newton step",
        )

    def within(self, iterations, seconds):
        """A step is within any budget."""
        return self

    def loosened(self, tolerance):
        """It is exact."""
        return self

    def within_gap(self, gap):
        """It has no gap."""
        return self

    def alternatives(self, *, warm):
        """None."""
        return ()


def test_a_solver() -> None:
    solver = OneNewtonStep()
    assert isinstance(solver, NlpSolver)
    found = solve(effort, settings=Settings(solver=solver))
    assert found.objective == pytest.approx(12.0, rel=1e-10)
    assert found.sensitivities()["goal"] == pytest.approx(24.0, rel=1e-8)
    assert {entry.solver for entry in found.mesh_iterations} == {"one Newton step"}


def hard_enough(answer: Evidence) -> Iterator[Finding]:
    """A diagnostic: the motor holds 6 m/s^2, and 5 m/s^2 if it is hot."""
    largest = float(np.abs(answer.solution.sample(u, np.linspace(0.0, 1.0, 101))).max())
    yield Finding("cold motor", largest, 6.0 + 1e-6, "the largest of 101 values [m/s^2]")
    yield Finding("hot motor", largest, 5.0, "the same for a hot motor [m/s^2]")


def test_a_diagnostic() -> None:
    certificate = certify(solve(effort), diagnostics=[hard_enough])
    assert [finding.passed for finding in certificate.checks] == [True, False]
    assert not certificate.passed


# ----- statements and options


def test_vectors() -> None:
    q, w, force = State("q", "m", shape=2), State("w", "m/s", shape=2), Control("force", shape=2)
    flat = Phase("flat", {q: w, w: force}, {q: [0, 0], w: 0}, final={q: [3, 4], w: [0, 0]}, end=1.0)
    found = solve(Problem("flat", flat, minimise=flat.integral(ca.sumsqr(force))))
    assert found.objective == pytest.approx(12 * 5**2, rel=1e-8)
    np.testing.assert_allclose(
        found.sample(q, [0.0, 0.5, 1.0]), [[0, 1.5, 3], [0, 2, 4]], atol=1e-6
    )


def test_an_expression_is_no_key_of_the_final_values() -> None:
    with pytest.raises(StatementError, match=r"'x\^2'.*bounds=\[phase.at_end\(x\^2\) == "):
        Phase("move", {x: v, v: u}, final={x**2: 1}, end=1.0)
    phase = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {v: 0}, end=1.0, guess={x: (0, 1)})
    squared = Problem(
        "squared", phase, minimise=phase.integral(u**2), bounds=[phase.at_end(x**2) == 1]
    )
    assert solve(squared).objective == pytest.approx(12.0, rel=1e-8)


def test_a_step_in_a_state_warns_when_it_is_stated() -> None:
    slow = ca.if_else(x > 0.5, 0.5, 1.0)
    phase = Phase("mud", {x: u * slow}, {x: 0}, {x: 1}, end=1.0)
    with pytest.warns(StatementWarning, match=r"rate of 'x'.*jumps where '0.5 < x'.*two phases"):
        Problem("mud", phase, minimise=phase.integral(u**2))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Problem("road", move, minimise=move.integral(u**2))


def test_any_option_of_ipopt(tmp_path) -> None:
    output = tmp_path / "ipopt.txt"
    options = {"output_file": str(output), "file_print_level": 5, "print_user_options": "yes"}
    solve(effort, settings=Settings(solver=Ipopt(options={**options, "max_soc": 3})))
    assert "max_soc" in output.read_text("utf-8")


def test_a_table_in_a_saved_solution(tmp_path) -> None:
    points = np.linspace(0.0, 1.0, 11)
    slope = Interpolant("slope", points, 1 + points**2)
    phase = Phase("hill", {x: u * slope(x)}, {x: 0}, {x: 1}, end=1.0)
    found = solve(Problem("hill", phase, minimise=phase.integral(u**2)))
    # the integral of 1 / slope is that of the effort, which is constant
    assert found.objective == pytest.approx((np.pi / 4) ** 2, rel=1e-6)
    save(found, tmp_path / "hill.zip")
    again = load(tmp_path / "hill.zip")
    np.testing.assert_array_equal(again.sample("u", points), found.sample(u, points))
    assert solve(again.problem).objective == pytest.approx(found.objective, rel=1e-9)


# ----- more than one solve


def test_a_front_of_two_objectives() -> None:
    """Effort against duration, 12 / T^3: their slope is a shadow price."""
    phase = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=Between(0.5, 3))
    work, time = phase.integral(u**2), phase.duration
    problem = Problem("hurry", phase, minimise=work)
    found = front(problem, limited=time, minimised=work, limits=(1.0, 2.0), points=4)
    assert [point.x for point in (found.points[0], found.points[-1])] == pytest.approx([1, 2])
    for point in found.points:
        assert point.y == pytest.approx(12 / point.x**3, rel=1e-6)
        assert point.slope == pytest.approx(-36 / point.x**4, rel=1e-3)


def test_a_controller_that_solves_again_at_each_step() -> None:
    """A cart is driven to zero, by the linear law that is known for a quadratic cost."""
    here, speed = Constant("here", "m", 1.0), Constant("speed", "m/s", 0.0)
    ahead = Phase("ahead", {x: v, v: u}, {x: here, v: speed}, end=8.0)
    problem = Problem("regulator", ahead, minimise=ahead.integral(x**2 + u**2))
    prepared = prepare(problem, settings=Settings(intervals=30, controls="polynomial"))
    state, last, step = np.array([1.0, 0.0]), None, 0.1
    for _ in range(10):
        last = prepared.solve(constants={here: state[0], speed: state[1]}, guess=last)
        push = last.sample(u, 0.0).item()
        # over a long horizon: u = -x - sqrt(2) v, by the Riccati equation
        assert push == pytest.approx(-state[0] - np.sqrt(2) * state[1], abs=5e-3)
        state = state + step * np.array([state[1] + push * step / 2, push])
    assert last is not None
    assert last.verification.passed


# ----- a review on a fuller model

DRAG = 0.4  # [1/s], which the statement leaves out


def with_drag(solution) -> dict[Constant, float]:
    """Where a cart with drag ends under the force of a solution."""

    def rates(time, state):
        return state[1], solution.sample(u, time).item() - DRAG * state[1]

    end = solve_ivp(rates, (0.0, 1.0), (0.0, 0.0), rtol=1e-10, atol=1e-12).y[:, -1]
    return {goal: end[0], rest: end[1]}


def reached_with_drag() -> np.ndarray:
    """Matrix from the targets (goal, rest) to the end of the cart with drag, in closed form.

    The least effort to the targets is ``u = (6 goal - 2 rest) + (6 rest - 12 goal) t``.
    """
    fade = np.exp(-DRAG)
    speed = np.array([(1 - fade) / DRAG, (DRAG - 1 + fade) / DRAG**2])  # of u = 1 and of u = t
    place = (np.array([1.0, 0.5]) - speed) / DRAG
    return np.array([place, speed]) @ np.array([[6.0, -2.0], [-12.0, 6.0]])


def test_a_fuller_model_reaches_the_target() -> None:
    found = corrected(effort, with_drag, {goal: 1e-6, rest: 1e-6})
    targets = np.linalg.solve(reached_with_drag(), [1.0, 0.0])
    assert found.targets[goal] == pytest.approx(targets[0], abs=1e-5)  # a small multiple of 1e-6
    assert found.targets[rest] == pytest.approx(targets[1], abs=1e-5)
    end = with_drag(found.solution)
    assert (end[goal], end[rest]) == pytest.approx((1.0, 0.0), abs=1e-6)
    assert found.misses[0][goal] == pytest.approx(1 - reached_with_drag()[0, 0], abs=1e-6)
    assert found.solution.verification.passed


def test_another_target_is_wanted() -> None:
    found = corrected(effort, with_drag, {goal: 1e-5, rest: 1e-5}, constants={goal: 2.0})
    assert with_drag(found.solution)[goal] == pytest.approx(2.0, abs=1e-5)


def test_a_fuller_model_that_does_not_answer_is_no_answer() -> None:
    with pytest.raises(Unverified, match=r"after 3 solves, at best 'goal' by 1 m;") as caught:
        corrected(effort, lambda solution: {goal: 0.0}, {goal: 1e-3}, solves=3)
    assert caught.value.iterate.objective == pytest.approx(12.0)


@pytest.mark.parametrize(
    ("tolerances", "reached", "words"),
    [
        ({}, {}, "there is no target"),
        ({x: 1e-3}, {}, r"'x' is not a constant of problem 'effort'.*final=\{x: goal\}"),
        ({goal: 0.0}, {}, "the tolerance of 'goal' is 0.0; give a positive number"),
        ({goal: 1e-3}, {rest: 0.0}, "the replay gives None for 'goal'"),
        ({goal: 1e-3}, {goal: np.nan}, "the replay gives nan for 'goal'"),
    ],
)
def test_a_correction_refuses_in_a_sentence(tolerances, reached, words) -> None:
    with pytest.raises(StatementError, match=words):
        corrected(effort, lambda solution: reached, tolerances)
