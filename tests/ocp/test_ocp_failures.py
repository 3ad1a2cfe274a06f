"""Failed solves say what is wrong in the words of the statement, and never pass for a solution."""

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Accuracy,
    AdaptiveMesh,
    Algebraic,
    Between,
    Bound,
    Collapsed,
    Constant,
    Control,
    FixedMesh,
    HomotopyStopped,
    Infeasible,
    InvalidNumber,
    Ipopt,
    IterationLimit,
    NumericalTrouble,
    Overdetermined,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    StatementError,
    StatementWarning,
    Unbounded,
    Unknown,
    Unverified,
    homotopy,
    relaxed,
    solve,
)
from tests.ocp.problems import double_integrator, solved_on

FEW = Settings(intervals=5, solver=Ipopt(max_iterations=200))
x, v, u, RATES = double_integrator(lower=-1, upper=1)
rate, push = Control("rate", "m/s"), Control("push", "m/s^2")


ROOF, LOW = Constant("roof", "m", 2.0), Constant("low", "m", 3.0)
FACTOR, HEIGHT = Unknown("k", lower=1, upper=3), State("h", "m", upper=ROOF)
FALL = {x: v, v: -9.81}


def task(rates=RATES, initial=None, final=None, objective=None, numbers=None, **options):
    """The least effort in a flight, or another function of it, within bounds of its numbers."""
    start = {x: 0, v: 0} if initial is None else initial
    phase = Phase("flight", rates, start, final or {}, **{"end": 1.0, **options})
    cost = phase.integral(u**2) if objective is None else objective(phase)
    bounds = [] if numbers is None else numbers(phase)
    return Problem("task", phase, minimise=cost, bounds=bounds)


def with_a_state_that_is_never_used():
    fuel = State("fuel", "kg")
    return task({x: v, v: u, fuel: -(u**2)}, {x: 0, v: 0, fuel: 1}, {x: 0.1})


ANSWERS = {
    "contradicting boundary values": (
        lambda: task(
            final={x: 0.1, v: 0},
            numbers=lambda phase: [Bound("landing", phase.at_end(x), "m", lower=0.2)],
        ),
        Infeasible,
        r"no motion was found.*'task' .*no proof.*; largest violations: 'landing' is violated by "
        r"0\.1 m; relax one",
    ),
    "an unreachable target": (
        lambda: task(final={x: 2}),
        Infeasible,
        r"'task' .*no proof.*; largest violations: dynamics of 'v' in phase 'flight' at 0\.\d+ s "
        r"is violated by .* m/s"
        r"; 'u' is at its upper limit of 1 m/s\^2 for 100% of 'flight': relax a limit or a "
        r"prescribed value \(ocp\.relaxed\(problem\) finds",
    ),
    "a free time that wants to be zero": (
        lambda: task(
            {v: u}, {v: 0}, {v: (-1, 1)}, lambda phase: phase.end_time, end=Between(0, 10, 1)
        ),
        Collapsed,
        r"motion of 'task' tends to zero duration .*e-\d+ s\), because nothing.*needs time",
    ),
    "an unbounded objective": (
        lambda: task({x: rate}, {x: 0}, objective=lambda phase: phase.at_end(x)),
        Unbounded,
        r"objective of 'task' seems unbounded: it is -.*; add bounds to the signals",
    ),
    "no number at the guess": (
        lambda: task({x: v, v: u + ca.sqrt(x - 5)}),
        InvalidNumber,
        r"'task': the derivative of 'v' in phase 'flight' is NaN or infinite at 0 s "
        r"\(in sqrt\(\(x-5\)\)\), where .*x = 0 m; give a guess at which all",
    ),
    "no number in a path constraint": (
        lambda: task(bounds=[Bound("log height", ca.log(x - 5), upper=3)]),
        InvalidNumber,
        r"'log height' in phase 'flight' is NaN or infinite at 0 s \(in log\(\(x-5\)\)\), where .*"
        r"x = 0 m; give a guess",
    ),
    "no number in an integrand": (
        lambda: task(objective=lambda phase: phase.integral(ca.sqrt(x - 5))),
        InvalidNumber,
        "'task': the integrand of 'integral' in phase 'flight' is NaN or infinite",
    ),
    "no number in the objective": (
        lambda: task(
            {x: rate}, {x: 0}, {x: 1}, lambda phase: FACTOR * ca.log(phase.at_end(x) - LOW)
        ),
        InvalidNumber,
        r"the objective is NaN or infinite \(in log\(\(end of flight-low\)\)\), "
        r"where k = 2, 'end of flight' = 1, low = 3 m; give a guess",
    ),
    "an infinite derivative": (
        lambda: task({x: v, v: u + ca.sqrt(x.symbol)}, guess={x: 0}),
        InvalidNumber,
        r"derivative of 'v' in phase 'flight' has a derivative.*at 0 s \(in .*sqrt\(x\).*x = 0 m",
    ),
    "a state without dynamics": (
        lambda: task({x: v}, {x: 0}),
        StatementError,
        r"phase 'flight' uses the state 'v' but has no dynamics.*add its derivat",
    ),
    "bounds that cross": (
        lambda: task({State("h", "m", lower=3, upper=ROOF): u}, {}),
        StatementError,
        r"bounds of 'h' contradict each other at roof = 2: lower 3 is above upper 2; change one",
    ),
    "a state that is never used": (
        with_a_state_that_is_never_used,
        StatementWarning,
        r"the state 'fuel' of phase 'flight' is never used.*remove it",
    ),
    "two signals of one name": (
        lambda: task({x: v, v: u, State("x", "m"): 1}),
        StatementError,
        r"'task' has more than one signal called 'x'; rename one of them",
    ),
    "an initial value beyond a bound that is a constant": (
        lambda: task({HEIGHT: u}, {HEIGHT: 3}),
        StatementError,
        r"initial value 3 of 'h' in phase 'flight' lies outside its bounds \[-inf, 2\] at roof",
    ),
    "a guess of something else": (
        lambda: task({HEIGHT: u}, {}, guess={x: 1.0}),
        StatementError,
        r"'flight' has a guess for 'x', but its dynamics.*remove the guess, or use the signal",
    ),
    "two bounds of one name": (
        lambda: task(bounds=[Bound("cap", x, upper=1), Bound("cap", x, upper=1)]),
        StatementError,
        r"'task' has more than one bound of one phase called 'cap'; rename",
    ),
    "more equations than unknowns": (
        lambda: task(
            FALL,
            {x: 1, v: 0},
            objective=lambda phase: phase.at_end(v),
            # 5 intervals of degree 4: 42 unknowns, 2 of them given; 40 rows of dynamics
            numbers=lambda phase: [
                Bound("a", phase.at_end(x), lower=0, upper=0),
                Bound("b", phase.at_end(v), lower=0, upper=0),
                Bound("c", phase.at_end(x) + phase.at_end(v), lower=0, upper=0),
            ],
        ),
        Overdetermined,
        r"'task' has 43 equations for 40 free unknowns.*over-determined; remove a bound",
    ),
    "a fall to a prescribed point": (
        lambda: task(FALL, {x: 1, v: 0}, {x: 0}, lambda phase: phase.at_end(v)),
        Overdetermined,
        r"40 equations.*39 free.*dynamics of 'v'.* m/s",
    ),
}


@pytest.mark.parametrize("case", ANSWERS)
def test_each_is_answered_in_the_users_words(case):
    statement, kind, words = ANSWERS[case]
    with pytest.raises(kind, match=words) as caught:
        solve(statement(), settings=FEW)
    # one sentence; that of a derivative has two remedies
    assert len(str(caught.value)) < (500 if "derivative" in case else 400)
    if kind is Infeasible:
        assert caught.value.iterate is not None


def test_an_unused_state_is_carried_along_all_the_same():
    with pytest.warns(StatementWarning, match="fuel"):
        found = solve(with_a_state_that_is_never_used(), settings=FEW)
    # x = int (1 - t) u: u = 0.3 (1 - t), int u^2 = 0.03
    assert found.objective == pytest.approx(0.03, rel=1e-9)


def test_a_used_up_budget_is_a_failure():
    settings = Settings(intervals=5, solver=Ipopt(max_iterations=1))
    with pytest.raises(
        IterationLimit, match=r"'task' reached its budget .*1 iterations.*raise the budget"
    ):
        solve(task(final={x: 0.1}), settings=settings)


@dataclasses.dataclass(frozen=True)
class Broken(Ipopt):
    """IPOPT that says after a solve that it broke off."""

    status: str = ""

    def solve(self, *arguments):
        return dataclasses.replace(super().solve(*arguments), outcome="failed", status=self.status)


@pytest.mark.parametrize("status", ["Error_In_Step_Computation", "Internal_Error"])
def test_numerical_trouble_is_called_that(status):
    settings = dataclasses.replace(FEW, solver=Broken(status=status))
    words = (
        rf"IPOPT stopped on 'task' after \d+ iterations with '{status}', with all constraints met"
    )
    with pytest.raises(NumericalTrouble, match=words):
        solve(task(final={x: 0.1}), settings=settings)


def coarse(**options):
    """A nonlinear problem on a mesh that is far too coarse for it."""
    rates = {x: v, v: u - 4 * ca.sin(x)}
    phase = Phase("swing", rates, initial={x: 1, v: 0}, end=3)
    settings = Settings(scheme=Radau(2), intervals=6, **options)
    return Problem("swing", [phase], maximise=phase.at_end(x)), settings


def test_a_coarse_answer_is_unverified():
    problem, settings = coarse(refinement=AdaptiveMesh(rounds=1))
    with pytest.raises(Unverified, match=r"'swing'.*replay misses.*more mesh iterations") as caught:
        solve(problem, settings=settings)
    found = caught.value.iterate
    assert found.verdict == "unverified"
    assert not found.verification.passed
    assert found.verification.miss > settings.accuracy.replay
    assert any("replay misses" in reason for reason in found.verification.reasons)


def test_without_refinement_the_verification_is_there_to_read():
    problem, settings = coarse(refinement=FixedMesh())
    found = solve(problem, settings=settings)
    assert not found.verification.passed
    loose = dataclasses.replace(settings, accuracy=Accuracy(replay=1e9, dynamics=1e9))
    assert solve(problem, settings=loose).verification.passed


def test_a_polynomial_control_keeps_its_bounds_between_the_points():
    # interpolation of degree 6 through a bang-bang law would overshoot by more than a tenth
    x, v, u, rates = double_integrator(lower=-1, upper=1, piecewise="polynomial")
    phase = Phase("dash", rates, {x: 0, v: 0}, {v: 0}, end=1)
    problem = Problem("overshoot", [phase], maximise=phase.at_end(x))
    values = solved_on(1, problem, scheme=Radau(6)).sample(u, np.linspace(0, 1, 1001))
    assert np.ptp(values) > 1.0  # it does switch
    assert np.abs(values).max() <= 1 + 1e-9  # round-off of the interpolation


@pytest.mark.parametrize("longest", [1.0, pytest.param(1000.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("rates", [{x: rate}, {x: v, v: rate}], ids=["speed", "force"])
def test_a_least_time_that_nothing_limits_collapses_at_once(rates, longest):
    start = dict.fromkeys(rates, 0)
    dash = Phase("dash", rates, start, {**start, x: 1}, end=Between(0, longest))
    with pytest.raises(
        Collapsed, match=r"motion of 'dash' tends to zero duration .* bound the controls"
    ):
        solve(Problem("dash", dash, minimise=dash.end_time))


def test_a_solved_motion_is_short_by_its_own_times_and_not_by_wide_limits():
    x, v, u, _ = double_integrator()

    def approach(longest):
        phase = Phase("approach", {x: v, v: u - v}, {x: 0, v: 0}, end=Between(0, longest))
        cost = phase.integral(u**2) + 0.1 * phase.end_time + (phase.at_end(x) - 1) ** 2
        return solve(Problem("approach", phase, minimise=cost)).objective

    assert approach(1e8) == pytest.approx(approach(20.0), rel=1e-7)


def test_a_failed_motion_is_short_by_its_own_times_and_not_by_wide_limits():
    x, v, _, rates = double_integrator(lower=-1e4, upper=1e4)
    phase = Phase("fast", rates, {x: 0, v: 0}, {x: 1e-3, v: 0}, end=Between(0, 1e5))
    solution = solve(Problem("fast", phase, minimise=phase.end_time))
    assert solution.objective == pytest.approx(2.0 * math.sqrt(1e-7), rel=1e-6)


@pytest.mark.slow
def test_unknowns_that_ran_away_beyond_all_rows_say_nothing_of_the_objective():
    """Dido's problem: a straight guess has no slope of its length, and the first run is lost."""
    x, u = State("x", "m"), Control("u")
    phase = Phase("rope", {x: u}, {x: 0}, {x: 0}, end=1.0)
    length = Bound("length", phase.integral(ca.sqrt(1 + u**2)), lower=1.2, upper=1.2)
    solution = solve(Problem("dido", phase, maximise=phase.integral(x), bounds=[length]))
    # an arc of a circle over a chord of 1
    low, high = 0.1, 3.0
    for _ in range(60):
        half = (low + high) / 2
        low, high = (half, high) if half < 1.2 * math.sin(half) else (low, half)
    radius = 0.6 / half
    area = radius**2 * half - radius * math.cos(half) / 2
    assert solution.objective == pytest.approx(area, rel=1e-7)


def growing(sign, **limits):
    """x' = x^2 + u from 0.9, or its mirror image, with the least effort over 5 s."""
    x, u = State("x", **limits), Control("u", "1/s", lower=-1, upper=1)
    phase = Phase("run", {x: sign * x**2 + u}, {x: sign * 0.9}, end=5.0)
    return Problem("growing", phase, minimise=phase.integral(u**2))


@pytest.mark.filterwarnings("ignore:the state")
@pytest.mark.parametrize(("sign", "side"), [(1, "upper"), (-1, "lower")])
def test_a_state_that_leaves_for_infinity_is_named_with_a_remedy(sign, side):
    with pytest.raises(Unbounded, match=rf"'x' of phase 'run' grows .* State\('x', {side}="):
        solve(growing(sign))


def test_with_a_limit_there_is_an_optimum():
    # 0.990516 by Runge-Kutta steps of 4th order and a plain nonlinear program
    assert solve(growing(1, lower=-5, upper=5)).objective == pytest.approx(0.9905151, rel=1e-6)


def test_a_motion_that_grows_and_has_an_end_is_none_of_these():
    x, u = State("x"), Control("u", "1/s", lower=-1, upper=1)
    phase = Phase("run", {x: 3 * x + u}, {x: 1}, end=5.0)
    found = solve(Problem("steep", phase, minimise=-phase.at_end(x) / 1e6))
    # x' = 3 x + 1 from 1
    assert found.objective == pytest.approx((1 - 4 * float(ca.exp(15))) / 3e6, rel=1e-6)


def rocket(**limits):
    """The most height at burnout: all fuel at once would be best."""
    mass, thrust = State("mass", "kg"), Control("thrust", "N", lower=0, **limits)
    rates = {x: v, v: thrust / mass - 1, mass: -thrust}
    start = {x: 0, v: 0, mass: 1}
    phase = Phase("burn", rates, start, {mass: 0.5, v: 0}, end=Between(0.1, 10))
    return Problem("rocket", phase, maximise=phase.at_end(x))


@pytest.mark.slow
def test_a_thrust_without_a_limit_is_named_with_the_remedy():
    with pytest.raises(NumericalTrouble, match=r"add a limit, as in Control\('thrust', upper"):
        solve(rocket())


def test_with_that_limit_it_is_solved():
    found = solve(rocket(upper=20))
    all_at_once = np.log(2) ** 2 / 2  # a speed of ln 2, and coasting to rest
    assert 0.95 * all_at_once < found.objective < all_at_once
    assert found.verification.passed


def test_a_lower_side_is_told_from_an_upper_one():
    """To hold a square small, x goes to zero at once."""
    phase = Phase("go", {x: rate}, initial={x: 1}, end=1.0)
    with pytest.raises(NumericalTrouble, match=r"as in Control\('rate', lower"):
        solve(Problem("drop", phase, minimise=phase.integral(x**2)))


def test_a_weight_that_vanishes_at_the_start_lets_all_be_done_there():
    """Weierstrass' kind: the less, the more of the way is gone while the weight is small."""
    phase = Phase("go", {x: rate}, initial={x: 0}, final={x: 1}, end=1.0)
    with pytest.raises(NumericalTrouble, match="the optimum is an impulse"):
        solve(Problem("weight", phase, minimise=phase.integral(TIME * rate**2)))


def test_a_layer_of_some_width_is_resolved():
    """A boundary layer of 1e-4 of the motion, with a control that nothing limits."""
    phase = Phase("go", {x: rate}, initial={x: 1}, end=1e4)
    found = solve(Problem("layer", phase, minimise=phase.integral(x**2 + rate**2)))
    assert found.objective == pytest.approx(1.0, rel=1e-6)  # tanh(1e4)


def test_what_a_solver_leaves_of_zero_is_no_impulse():
    """Two parts of a modulus, one of which is zero: |x - 1| + u^2 / 2 from 0, never beyond 1."""
    rate, above, below = Control("rate"), Control("above", lower=0), Control("below", lower=0)
    parts = Bound("parts", x - 1 - above + below, lower=0, upper=0)
    phase = Phase("go", {x: rate}, initial={x: 0}, end=3.0, bounds=[parts])
    found = solve(Problem("track", phase, minimise=phase.integral(above + below + rate**2 / 2)))
    assert found.objective == pytest.approx(2 * np.sqrt(2) / 3, rel=1e-6)


def test_a_pole_of_the_control_is_resolved():
    """x = sqrt(t) under the weight t^(3/2) x'^4: the control is the slope, endless at the start."""
    rate = Control("rate", "m/s", lower=0)
    phase = Phase("go", {x: rate}, initial={x: 0}, final={x: 1}, end=1.0)
    problem = Problem("pole", phase, minimise=phase.integral((TIME**1.5) * rate**4))
    found = solve(problem)
    # the size of the control there is not that of the objective
    again, without_multipliers = (
        solve(problem, guess=guess, mesh=found.mesh) for guess in (found, found.trajectory)
    )
    for answer in (found, again, without_multipliers):
        assert answer.objective == pytest.approx(0.5**4 * 2, rel=1e-5)
        assert answer.accuracy <= 1e-5


def over(bound, far=1.0):
    """A move from rest to rest within a limit."""
    rates = {x: v, v: push}
    move = Phase("move", rates, {x: 0, v: 0}, {x: far, v: 0}, end=1.0, bounds=[bound])
    return Problem("over", move, minimise=move.integral(push**2))


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
@pytest.mark.parametrize(
    ("beyond", "told"),
    [(1e-5, True), (1e-7, True), pytest.param(1e-9, False, marks=pytest.mark.slow)],
)
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
        Bound("force", push + x, "m/s^2", upper=20),
        Bound("below", y, "m", upper=1),
    ]
    rates = {x: v, v: push}
    move = Phase("move", rates, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0, bounds=bounds)
    found = solve(Problem("free", move, minimise=move.integral(push**2) + p))
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
