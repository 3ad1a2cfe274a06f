"""The replay against closed forms and other integrators, how errors grow, what must not pass."""

import itertools
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import minimize_scalar

from ocp import (
    TIME,
    Accuracy,
    Constant,
    Control,
    FixedMesh,
    Phase,
    PhaseTrajectory,
    Problem,
    Radau,
    Settings,
    State,
    Trajectory,
    Unknown,
    joined,
    solve,
)
from ocp.mesh.trajectory import SignalGroup
from ocp.numerics.integrators import SUBSTEPS, backward_differences, extrapolated_step
from ocp.numerics.piecewise_polynomial import Bernstein, Lagrange, Piece, PiecewisePolynomial
from ocp.verification.simulation import (
    exponential,
    growth,
    replayed,
    segments,
    simulate,
    transitions,
)
from tests.ocp.problems import certified, cubic_oscillator, least_effort


@pytest.mark.parametrize("weight", [1e-4, 1e-6])
def test_the_objective_is_as_exact_as_was_asked(weight):
    # errors of 27 to 37 intervals, each below its tolerance, made 4e-6 of it
    x, u = State("x"), Control("u")
    phase = Phase("layer", {x: u}, {x: 1}, end=1.0)
    problem = Problem("layer", phase, minimise=phase.integral(x**2 + weight * u**2))
    least = np.sqrt(weight) * np.tanh(1 / np.sqrt(weight))
    found = certified(problem, least)
    assert found.verification.replayed_objective == pytest.approx(found.objective, rel=1e-6)


@pytest.mark.parametrize("hole_first", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_replay_without_values_does_not_pass(hole_first):
    """A root has none for 4 ms between two points, so that one of two states is lost there."""
    x, y, u = State("x", upper=9), State("y"), Control("u")
    rates = {x: u + 1e-3 * ca.sqrt((TIME - 0.5175) ** 2 - 0.002**2), y: u}
    states = (x, y) if hole_first else (y, x)
    phase = Phase("go", {s: rates[s] for s in states}, {x: 0, y: 0}, {y: 1}, end=1.0)
    problem = Problem("hole", phase, minimise=phase.integral(u**2))
    verification = solve(problem, settings=Settings(refinement=FixedMesh())).verification
    assert np.isnan(verification.miss)
    assert not verification.passed
    assert "the replay leads to values that are no numbers" in verification.reasons[0]


@pytest.mark.parametrize("rate", [-1.0, -2.0])
def test_one_step_has_twice_the_order_of_its_substeps(rate):
    x, span = ca.SX.sym("x"), ca.SX.sym("span")
    end, _ = extrapolated_step(lambda state, tau: rate * state * (1 + tau), x, span)
    step = ca.Function("step", [x, span], [end])
    spans = np.array([0.8, 0.4, 0.2])
    errors = [abs(float(step(1.0, h)) - np.exp(rate * (h + h**2 / 2))) for h in spans]
    slope = np.polyfit(np.log(spans), np.log(errors), 1)[0]
    # a local error is one order higher than the method; steps this long still bend the line
    assert slope == pytest.approx(2 * len(SUBSTEPS) + 1, abs=1.0)


def stepped(breakpoints, accelerations, start):
    """A trajectory of a double integrator under constant accelerations, in closed form."""
    lengths = np.diff(breakpoints)
    x, v = [start[0]], [start[1]]
    for a, h in zip(accelerations, lengths, strict=True):
        x.append(x[-1] + v[-1] * h + a * h**2 / 2)
        v.append(v[-1] + a * h)
    x, v = np.array(x), np.array(v)
    tau = np.array([0.0, 1 / 3, 1.0])  # support of two Radau points
    s = tau * lengths[:, None]
    a = np.asarray(accelerations)[:, None]
    states = np.stack([x[:-1, None] + v[:-1, None] * s + a * s**2 / 2, v[:-1, None] + a * s], 2)
    controls = np.asarray(accelerations)[:, None, None]
    points, every = np.asarray(breakpoints), np.arange(len(lengths))
    groups = (
        group("state", ("x", "v"), points, Piece(every, Lagrange(tuple(tau)), states)),
        group("control", ("u",), points, Piece(every, Bernstein(1), controls)),
    )
    phase = PhaseTrajectory("move", Radau(2), points, np.full(len(lengths), 2), groups)
    return Trajectory((phase,)), x, v


def group(kind, names, breakpoints, piece):
    return SignalGroup(kind, names, PiecewisePolynomial(breakpoints, (piece,)))


def off(phase, kind, by, where=...):
    """A phase whose coefficients of a kind of signals are off, all of them or those at a place."""

    def moved(piece):
        coefficients = piece.coefficients.copy()
        coefficients[where] += by
        return replace(piece, coefficients=coefficients)

    def changed(group):
        pieces = tuple(moved(piece) for piece in group.polynomial.pieces)
        return replace(group, polynomial=replace(group.polynomial, pieces=pieces))

    return replace(phase, groups=tuple(changed(g) if g.kind == kind else g for g in phase.groups))


def pushed(phase, by):
    """A phase whose controls are off."""
    return off(phase, "control", by)


def ended(phase, by):
    """A phase that says it ends elsewhere in its first state."""
    return off(phase, "state", by, (-1, -1, 0))


MOVE = least_effort(piecewise="constant")


accelerations = st.lists(st.floats(-10, 10), min_size=1, max_size=12)


@given(controls=accelerations, start=st.tuples(st.floats(-5, 5), st.floats(-5, 5)))
def test_replay_of_random_steps_of_acceleration_is_the_closed_form(controls, start):
    points = np.cumsum([0.0, *(0.1 + 0.05 * np.arange(len(controls)) % 0.3)])
    trajectory, x, v = stepped(points, controls, start)
    done = simulate(MOVE, trajectory, {"x": 1.0, "v": 1.0})
    found = done.phases[0].states
    # parabolas are exact for the midpoint rule: round-off of values up to 100
    np.testing.assert_allclose(found[:, -1, 0], x[1:], atol=1e-12)
    np.testing.assert_allclose(found[:, -1, 1], v[1:], atol=1e-12)
    assert done.miss < 1e-12
    again = replayed(trajectory, done)
    times = np.linspace(points[0], points[-1], 31)
    np.testing.assert_allclose(
        again.phases[0].sample(times), trajectory.phases[0].sample(times), atol=1e-11
    )


@given(controls=accelerations, off=st.floats(1e-6, 1.0))
def test_replay_notices_a_wrong_end(controls, off):
    trajectory, _, _ = stepped(np.linspace(0, 2, len(controls) + 1), controls, (0.0, 0.0))
    wrong = ended(trajectory.phases[0], off)
    done = simulate(MOVE, replace(trajectory, phases=(wrong,)), {"x": 10.0, "v": 1.0})
    assert done.miss == pytest.approx(off / 10.0, rel=1e-5)  # round-off of the smallest offset
    assert done.phases[0].miss[0] == pytest.approx(-off, rel=1e-5)


def test_replay_notices_a_wrong_control():
    trajectory, _, _ = stepped(np.linspace(0, 2, 5), [1.0, -1.0, 2.0, 0.0], (0.0, 0.0))
    wrong = pushed(trajectory.phases[0], np.array([0.0, 0.01, 0.0, 0.0])[:, None, None])
    done = simulate(MOVE, replace(trajectory, phases=(wrong,)), {"x": 1.0, "v": 1.0})
    # 0.01 m/s^2 over 0.5 s, then coasting for 1 s
    np.testing.assert_allclose(done.phases[0].miss, [0.005 * 0.25 + 0.005, 0.005], rtol=1e-9)


def swing():
    """A driven pendulum with a constant, an unknown, running time and all shapes of control."""
    angle, rate = State("angle", "rad"), State("rate", "rad/s")
    push, lean, kick = (
        Control(n, lower=-1, upper=1, piecewise=s)
        for n, s in (("push", "polynomial"), ("lean", "linear"), ("kick", "constant"))
    )
    gravity, drag = Constant("gravity", "1/s^2", 4.0), Unknown("drag", "1/s", 0.1, 0.4)
    forces = push + 0.5 * lean * ca.cos(angle) + 0.3 * kick * ca.sin(TIME)
    phase = Phase(
        "swing",
        {angle: rate, rate: forces - gravity * ca.sin(angle) - drag * rate},
        initial={angle: 0.5, rate: 0.0},
        final={rate: 0.0},
        start=1.0,
        end=4.0,
    )
    cost = phase.integral(push**2 + lean**2 + kick**2) + (phase.at_end(angle) - 1.0) ** 2 * 50
    return Problem("swing", [phase], minimise=cost + drag), (angle, rate, push, lean, kick), drag


@pytest.mark.parametrize(("accuracy", "apart"), [(1e-6, 1e-9), (1e-3, 1e-6)])
def test_replay_agrees_with_another_integrator(accuracy, apart):
    problem, (angle, rate, push, lean, kick), drag = swing()
    asked = Accuracy(replay=accuracy)
    settings = Settings(intervals=8, refinement=FixedMesh(), accuracy=asked)
    found = solve(problem, settings=settings)

    def rates(t, y, k):
        tau = (t - points[k]) / (points[k + 1] - points[k])
        signals = own.local(np.array([k]), np.array([tau]))[0]
        u, w, c = (signals[names.index(name)] for name in ("push", "lean", "kick"))
        force = u + 0.5 * w * np.cos(y[0]) + 0.3 * c * np.sin(t)
        return [y[1], force - 4.0 * np.sin(y[0]) - found.value(drag) * y[1]]

    own = found.trajectory.phases[0]
    names, points = own.signals, own.breakpoints
    y = np.array([0.5, 0.0])
    for k in range(len(points) - 1):  # restarted where the controls may jump
        y = solve_ivp(
            rates, points[k : k + 2], y, args=(k,), method="DOP853", rtol=1e-12, atol=1e-13
        ).y[:, -1]
    # tolerances of both integrators: 1e-5 of what may be missed a step, and 1e-12
    np.testing.assert_allclose(found.replay.phases[0].states[-1, -1], y, atol=apart)
    for signal, end in zip((angle, rate), y, strict=True):
        assert found.sample(signal, 4.0, replayed=True) == pytest.approx(end, abs=apart)
        assert found.sample(signal, 4.0) != pytest.approx(end, abs=1e-12)  # coarse mesh: no copy
    assert {s.name for s in (push, lean, kick)} <= set(names)


def test_a_replay_goes_through_all_phases():
    x, v, u = State("x"), State("v"), Control("u")
    first = Phase("first", {x: v, v: u - x**3}, initial={x: 0, v: 0}, end=1)
    second = Phase("second", {x: v, v: u}, final={x: 1, v: 0}, start=1, end=2)
    cost, links = first.integral(u**2) + second.integral(u**2), joined(first, second)
    problem = Problem("two", [first, second], minimise=cost, links=links)
    found = solve(problem)
    first_phase, second_phase = found.trajectory.phases
    # the first phase says it ends where it does not
    spoilt = replace(found.trajectory, phases=(ended(first_phase, 1e-3), second_phase))
    assert found.verification.miss < 1e-6  # as `Accuracy` says
    assert simulate(problem, spoilt, {"x": 1.0, "v": 1.0}).miss == pytest.approx(1e-3, rel=1e-2)

    # a control that is off in the first phase shifts the second one too, which then coasts for 1 s
    wrong = replace(found.trajectory, phases=(pushed(first_phase, 0.01), second_phase))
    one, two = simulate(problem, wrong, {"x": 1.0, "v": 1.0}).phases
    assert one.miss[1] > 1e-3
    # errors of the unspoilt solution add to both sides
    np.testing.assert_allclose(two.miss, [one.miss[0] + one.miss[1], one.miss[1]], atol=1e-7)


def unstable(end):
    """x' = 2 x + u held at rest at both ends, after a push: errors grow as exp(2 t)."""
    x, u = State("x"), Control("u")
    phase = Phase("hold", {x: 2 * x + u}, {x: 1}, {x: 0}, end=end)
    return Problem("hold", [phase], minimise=phase.integral(u**2))


def test_the_amplification_is_the_growth_of_the_variational_equation():
    found = solve(unstable(5.0))
    # df/dx is constant and exact, so that the exponential is exact up to rounding
    assert found.replay.amplification == pytest.approx(np.exp(10.0), rel=1e-10)
    assert found.verification.amplification == found.replay.amplification
    assert found.replay.restarts == 0


def test_a_motion_that_amplifies_too_much_is_replayed_in_segments():
    found = solve(unstable(20.0))
    assert found.objective == pytest.approx(4.0 / (1 - np.exp(-80.0)), rel=1e-5)
    assert found.verification.amplification == pytest.approx(np.exp(40.0), rel=1e-4)
    # a restart every ln(1e6) / 2 = 6.9 s at least
    assert found.verification.restarts >= 2
    assert found.verification.passed
    # a control that is off is still noticed
    wrong = replace(found.trajectory, phases=(pushed(found.trajectory.phases[0], 1e-4),))
    assert simulate(found.problem, wrong, found.replay.sizes).miss > 1e-4


def test_a_phase_starts_anew_where_those_before_it_amplified_too_much():
    x, u = State("x"), Control("u")
    times = [0.0, 3.0, 6.0, 9.0]
    ends = [({x: 1}, {}), ({}, {}), ({}, {x: 0})]
    phases = [
        Phase(f"phase {i}", {x: 2 * x + u}, *ends[i], start=times[i], end=times[i + 1])
        for i in range(3)
    ]
    links = (*joined(phases[0], phases[1]), *joined(phases[1], phases[2]))
    effort = sum((p.integral(u**2) for p in phases[1:]), phases[0].integral(u**2))
    found = solve(Problem("three", phases, minimise=effort, links=links))
    # exp(6) a phase: two phases stay below 1e6, three do not
    assert [p.restarts for p in found.replay.phases] == [0, 0, 1]
    assert found.replay.amplification == pytest.approx(np.exp(6.0), rel=1e-6)


def stiff_rate():
    """A state that follows the sine of time within a microsecond."""
    x, u, t = ca.SX.sym("x"), ca.SX.sym("u", 0), ca.SX.sym("t")
    return ca.Function("rate", [x, u, t], [-1e6 * (x - ca.sin(t)) + ca.cos(t)])


def test_backward_differences_follow_a_stiff_motion():
    first, last = np.array([0.0, 1.0]), np.array([1.0, 3.0])
    states = backward_differences(
        stiff_rate(), np.zeros(1), np.zeros((2, 0, 1)), (first, last), np.ones(1), 4, 1e-11
    )
    times = first[:, None] + np.linspace(0, 1, 5) * (last - first)[:, None]
    # hundreds of steps with errors of 1e-11, most of which decay at once
    np.testing.assert_allclose(states[:, :, 0], np.sin(times), atol=1e-9)


def test_backward_differences_say_where_there_is_no_motion():
    x = ca.SX.sym("x")
    explosion = ca.Function("rate", [x, ca.SX.sym("u", 0), ca.SX.sym("t")], [x**2])
    # x = 1/(1 - t)
    times = np.array([0.0]), np.array([2.0])
    assert (
        backward_differences(
            explosion, np.ones(1), np.zeros((1, 0, 1)), times, np.ones(1), 4, 1e-11
        )
        is None
    )


def test_a_stiff_motion_is_replayed_and_a_wrong_control_noticed():
    x, y, u = State("x"), State("y", upper=2), Control("u")
    phase = Phase("follow", {x: u, y: -1e6 * (y - x)}, {x: 0, y: 0}, {x: 1}, end=1.0)
    found = solve(Problem("follow", [phase], minimise=phase.integral(u**2)))
    # u = 1, so that y lags by a microsecond
    assert found.verification.passed
    assert found.replay.phases[0].states[-1, -1] == pytest.approx([1.0, 1.0 - 1e-6], abs=1e-9)
    wrong = replace(found.trajectory, phases=(pushed(found.trajectory.phases[0], 1e-4),))
    assert simulate(found.problem, wrong, found.replay.sizes).miss == pytest.approx(1e-4, rel=1e-2)


def test_kinetics_of_a_day_that_begin_within_a_millisecond():
    # H. H. Robertson 1966; Hairer and Wanner, Solving Ordinary Differential Equations II, IV.1
    a, b, c = State("a"), State("b", scale=4e-5), State("c")
    slow, back, fast = 0.04 * a, 1e4 * b * c, 3e7 * b**2
    rates = {a: back - slow, b: slow - back - fast, c: fast}
    phase = Phase("reaction", rates, {a: 1, b: 0, c: 0}, end=END)
    found = solve(Problem("Robertson", [phase], minimise=phase.at_end(c)))

    by_scipy = solve_ivp(kinetics, (0, END), [1, 0, 0], method="Radau", rtol=1e-10, atol=1e-15)
    assert found.sample(c, END) == pytest.approx(by_scipy.y[2, -1], rel=1e-6)
    assert np.diff(found.mesh.phases[0].breakpoints)[0] < 1e-7


END = 1e5  # [s]
TIMES = np.array([1e-2, 1.0, 1e2, 1e4])  # at which values are measured [s]


def kinetics(t, x, factor=1.0):
    """Robertson's three substances; the second in units of 3.65e-5."""
    del t
    a, b, c = x
    r1, r2, r3 = 0.04 * factor * a, 0.365 * b * c, 3e7 * (3.65e-5 * b) ** 2
    return [r2 - r1, (r1 - r2 - r3) / 3.65e-5, r3]


def motion(times, factor=1.0):
    found = solve_ivp(
        kinetics, (0, END), [1, 0, 0], "Radau", times, args=(factor,), rtol=1e-8, atol=1e-10
    )
    return found.y


def measured():
    """Values that are off by one per cent, up and down by turns, (3, m)."""
    return motion(TIMES) * (1.0 + 0.01 * (-1.0) ** np.arange(TIMES.size))


def fit():
    """The rate of the first reaction, off by 30 % in the guess."""
    a, b, c = (State(name, lower=0, upper=2) for name in "abc")
    log = Unknown("log", lower=-2, upper=2, guess=0.3)
    rates = kinetics(0, [a.symbol, b.symbol, c.symbol], ca.exp(log.symbol))
    phase = Phase(
        "reaction",
        dict(zip((a, b, c), rates, strict=True)),
        initial={a: 1, b: 0, c: 0},
        end=END,
    )
    values = measured()
    misfit = sum(
        (phase.at(float(t), signal) - float(v)) ** 2
        for signal, row in zip((a, b, c), values, strict=True)
        for t, v in zip(TIMES, row, strict=True)
    )
    return Problem("kinetics", [phase], minimise=1e4 * misfit)


@pytest.mark.slow
def test_a_stiff_fit_is_found() -> None:
    values = measured()

    def misfit(log):
        return 1e4 * float(np.sum((motion(TIMES, np.exp(log)) - values) ** 2))

    best = minimize_scalar(misfit, bounds=(-0.1, 0.1), options={"xatol": 1e-5})
    # the default tolerance
    solution = certified(fit(), best.fun, 1e-5)
    assert solution.trajectory.unknowns["log"] == pytest.approx(best.x, abs=1e-4)

    # in some intervals the terms of H are hundreds of times their mean size


@pytest.mark.parametrize("size", [0.0, 1e-8, 0.3, 5.0, 40.0])
def test_the_exponential_is_that_of_scipy(size: float) -> None:
    matrices = size * np.random.default_rng(1).normal(size=(5, 4, 4)) / 4
    wanted = expm(matrices)
    error = np.abs(exponential(matrices) - wanted).max(axis=(1, 2))
    # both square back; a growth by 1e10 costs a few digits, a factor of interest 1e6
    assert (error <= 1e-11 * np.abs(wanted).max(axis=(1, 2))).all()


def test_what_overflows_is_not_finite_and_warns_nobody() -> None:
    found = exponential(np.array([[[1e6, 0.0], [0.0, 0.0]]]))
    assert not np.isfinite(found).all()


def held_motion(breakpoints: list[float], **constants: float) -> PhaseTrajectory:
    """A phase in which every signal stays where it is."""
    points, count = np.array(breakpoints), len(breakpoints) - 1

    def held(kind: str, names: tuple[str, ...]) -> SignalGroup:
        values = np.tile([constants[name] for name in names], (count, 1, 1))
        piece = Piece(np.arange(count), Bernstein(1), values)
        return SignalGroup(kind, names, PiecewisePolynomial(points, (piece,)))

    groups = (held("state", ("angle", "rate")), held("control", ("push",)))
    return PhaseTrajectory("swing", Radau(1), points, np.ones(count, dtype=int), groups)


def test_transitions_of_a_pendulum_at_rest() -> None:
    # x'' = -g sin x + u at x = 0: errors turn as those of an oscillator of frequency sqrt(g)
    x, u, t = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("t")
    rate = ca.Function("rate", [x, u, t], [ca.vertcat(x[1], u - 4.0 * ca.sin(x[0]))])
    sizes = np.array([0.1, 10.0])
    found = transitions(rate, held_motion([0.0, 0.3, 1.0], angle=0.0, rate=0.0, push=0.0), sizes)
    for matrix, h in zip(found, (0.3, 0.7), strict=True):
        c, s = np.cos(2.0 * h), np.sin(2.0 * h)
        exact = np.array([[c, s / 2.0], [-2.0 * s, c]]) * sizes / sizes[:, None]
        # the Jacobian is exact and constant: rounding of the exponential alone
        np.testing.assert_allclose(matrix, exact, rtol=1e-12, atol=1e-12)


def test_where_there_is_no_derivative_growth_is_taken_as_none() -> None:
    x, u, t = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("t")
    rate = ca.Function("rate", [x, u, t], [ca.vertcat(x[1], ca.sqrt(x[0]) + u)])
    found = transitions(rate, held_motion([0.0, 1.0], angle=0.0, rate=0.0, push=0.0), np.ones(2))
    np.testing.assert_allclose(found[0], [[1.0, 1.0], [0.0, 1.0]], atol=1e-14)


def test_segments_amplify_less_than_is_allowed() -> None:
    steps = np.full((20, 1, 1), 10.0)  # errors grow tenfold in each of twenty intervals
    assert growth(steps) == pytest.approx(1e20)
    parts = segments(steps)
    assert [part.start for part in parts[1:]] == [part.stop for part in parts[:-1]]
    assert (parts[0].start, parts[-1].stop) == (0, 20)
    assert all(growth(steps[part]) <= 1e6 for part in parts)


def test_an_unstable_motion_is_held_to_its_nodes_and_says_so():
    x, u = State("x"), Control("u")
    phase = Phase("balance", {x: 12 * ca.sin(x) + u}, {x: 0.5}, {x: 0}, end=1.0)
    problem = Problem("balance", [phase], minimise=phase.integral(u**2 + x**2))
    found = solve(problem, settings=Settings(accuracy=1e-3, intervals=4))
    check = found.verification
    assert check.passed
    assert check.restarts > 0
    assert check.miss <= 1e-3 < 0.05 < check.one_run
    assert f"at the end is {check.one_run:.1e} (errors grow by a factor of 15" in found.verdict
    assert found.objective == pytest.approx(solve(problem).objective, rel=found.accuracy)


@pytest.mark.parametrize("intervals", [3, 5])
def test_the_error_of_the_dynamics_is_what_they_depart_by_within_an_interval(intervals):
    swing = cubic_oscillator(2.5, effort=True)
    found = solve(swing, settings=Settings(intervals=intervals, refinement=FixedMesh()))
    (x, v), (u,) = swing.phases[0].states, swing.controls["swing"]
    sizes = np.array([[found.kept_iterate.scales.signals[s.name]] for s in (x, v)])

    def rates(time, y):
        return [y[1], found.sample(u, [time])[0] - y[0] ** 3]

    farthest = 0.0
    for ends in itertools.pairwise(found.trajectory.phases[0].breakpoints):
        # a hair inside, where a sample belongs to this interval
        times = np.linspace(*ends, 40) + np.linspace(1e-12, -1e-12, 40)
        own = np.array([found.sample(s, times) for s in (x, v)])
        exact = solve_ivp(rates, times[[0, -1]], own[:, 0], t_eval=times, rtol=1e-11, atol=1e-12).y
        farthest = max(farthest, np.abs((exact - own) / sizes).max())
    # to first order, and intervals of a second are long
    assert found.verification.dynamics == pytest.approx(farthest, rel=0.1)
