"""Certificates of known optima and of spoiled solutions, and each diagnostic that they ask."""

import dataclasses
import math
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
import pytest

from ocp import (
    STANDARD,
    TIME,
    AdaptiveMesh,
    Between,
    Bound,
    Control,
    FixedMesh,
    Gauss,
    HermiteSimpson,
    Ipopt,
    Lobatto,
    NlpSolver,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    StatementError,
    Trapezoid,
    Unverified,
    certify,
    confirm,
    joined,
    peak,
    solve,
)
from tests.ocp.problems import (
    bryson_denham,
    certified,
    check_of,
    dash,
    double_integrator,
    failed,
    least_effort,
    rest_to_rest,
    solved_on,
    with_costates,
)


def least_peak():
    """Two phases of thrust, 4 m/s^2 each, at most half of it counted; H = -8 / 2."""
    x, v, u, rates = double_integrator(piecewise="constant")
    meeting = Between(0.1, 0.9)
    first = Phase("first", rates, {x: 0, v: 0}, start=0, end=meeting)
    second = Phase("second", rates, final={x: 1, v: 0}, start=meeting, end=1)
    top = peak((first, u), (second, u), absolute=True, name="thrust", unit="m/s^2")
    return Problem("least peak", [first, second], minimise=0.5 * top, links=joined(first, second))


@pytest.mark.parametrize(
    ("problem", "optimum", "hamiltonian"),
    [
        (least_effort(piecewise="polynomial"), 12.0, -36.0),
        (dash(), 30.0, -1.0),
        (bryson_denham(), 4.0, 0.0),
        (least_peak(), 2.0, -4.0),
    ],
)
def test_known_optima_are_certified(problem, optimum, hamiltonian):
    certificate = certify(certified(problem, optimum))
    assert certificate.objective == pytest.approx(optimum, rel=1e-6)
    (first, *_) = [c for c in certificate.checks if c.name.startswith("Hamiltonian of")]
    constant = float(first.sentence.split("its mean is ")[1].split(",")[0])
    # costates are of first order in the intervals that hold a jump
    assert constant == pytest.approx(hamiltonian, rel=1e-4, abs=16e-4)


@pytest.mark.slow
def test_piecewise_constant_controls_are_tested_by_interval_means():
    found = certified(least_effort(piecewise="constant"), 12.0, within=1e-5)
    # at points, the slope is off by half a step of 12 / 500 of 12; the mean is not
    assert check_of(found, "dH/du").value < 1e-6


def test_time_in_the_dynamics():
    # x' = u / (1 + t) to x = 1 with int u^2 and a price of time of 1: H is not constant, but
    # transversality holds at the end
    x, u = State("x"), Control("u")
    phase = Phase("go", {x: u / (1 + TIME)}, {x: 0}, {x: 1}, end=Between(0.1, 9, 1))
    problem = Problem(
        "clock",
        [phase],
        minimise=phase.integral(u**2) + phase.end_time,
        bounds=[Bound("late", phase.end_time, "s", upper=5.0)],
    )
    certificate = certify(solve(problem))
    names = [c.name for c in certificate.checks]
    assert "Hamiltonian at the end of 'go'" in names
    assert "Hamiltonian of 'go'" not in names
    assert certificate.passed, str(certificate)


def test_the_hamiltonian_may_jump_at_named_instants():
    # a data fit: int u^2 + 100 (x(0.4) - 1)^2: u is constant on either side, H = -u^2 jumps
    x, u = State("x"), Control("u")
    phase = Phase("fit", {x: u}, {x: 0}, {x: 0}, end=1.0)
    missed = (phase.at(0.4, x) - 1) ** 2
    found = solve(Problem("fit", [phase], minimise=phase.integral(u**2) + 100 * missed))
    certificate = certify(found)
    assert certificate.passed, str(certificate)
    assert abs(found.sample(u, 0.2)) > 1.2 * abs(found.sample(u, 0.7))


def test_between_changes_the_minimum_principle_holds_strictly():
    # a switch smears costates over its interval only: H = -1 elsewhere, to the dual tolerance
    within = check_of(solve(dash()), "between changes of 'dash': Hamiltonian")
    assert within.value < 1e-7
    assert "intervals contain a change or are next to one" in within.sentence


def test_a_costate_that_is_off_between_changes_fails():
    found = solved_on(20, least_effort(piecewise="constant"))
    spoilt = with_costates(found, np.where(np.arange(20) == 7, 1.0 + 1e-3, 1.0))
    names = {f"between changes of 'move': {name}" for name in ("Hamiltonian", "dH/du")}
    assert names <= failed(spoilt)


@pytest.mark.parametrize(
    ("first", "last", "duration", "weight"),
    [(1.03344, 0.517014, 78.8332, 0.646559), (1.1565, 0.840328, 72.2738, 0.553894)],
)
def test_a_long_rest_between_a_start_and_an_end_is_certified(first, last, duration, weight):
    """Hypersensitive (Rao and Mease 2000): H is 0 on the ways to the rest and from it."""
    x, u = State("x", ""), Control("u", "")
    phase = Phase("run", {x: -(x**3) + u}, {x: first}, {x: last}, end=duration)
    problem = Problem("rest", phase, minimise=phase.integral((x**2 + weight * u**2) / 2))

    def cost(end, sign):
        """Of the way from `end` to the rest, or back, where H = 0 gives the costate."""
        places, weights = np.polynomial.legendre.leggauss(40)
        at = end * (places + 1) / 2
        costates = weight * (sign * at**3 + np.sqrt(at**6 + at**2 / weight))
        return end / 2 * weights @ costates

    certified(problem, cost(first, -1) + cost(last, 1))


def towards(intervals, **limits):
    """u = 1 is best, close to its bound."""
    x, u = State("x", "m"), Control("u", "m/s", piecewise="constant", **limits)
    phase = Phase("go", {x: u}, {x: 0}, {x: 1}, end=1.0)
    return solved_on(intervals, Problem("go", [phase], minimise=phase.integral(u**2)))


def test_what_a_barrier_leaves_of_a_bound_is_no_slope():
    # 1e-4 off its bound a barrier of 1e-12 pushes with 1e-8: in 1 / 200 of the time, and relative
    # to terms of 4, that is a slope of 2.5e-7; the rest is rounding
    found = towards(200, upper=1 + 1e-4)
    assert certify(found).passed
    assert check_of(found, "between changes of 'go': dH/du").value < 1e-10


def pushed_off(part, intervals=200):
    """A costate that is too large by a part, and bound multipliers that balance it 1e-3 off."""
    found = towards(intervals, upper=1 + 1e-3)
    iterate = found.kept_iterate
    ((_, _, controls),) = iterate.transcription.columns.phases[0].coefficients
    pushing = iterate.bound_multipliers.copy()
    size = iterate.scales.signals["u"] / iterate.scales.objective
    pushing[controls] += 2 * part / intervals * size
    pushed = dataclasses.replace(
        found, iterate=dataclasses.replace(iterate, bound_multipliers=pushing)
    )
    return with_costates(pushed, 1 + part)


def test_a_slope_that_no_barrier_leaves_fails():
    # all products together are 2e-3 times 1e-3 of the objective
    assert "between changes of 'go': dH/du" in failed(pushed_off(1e-3))


def test_a_slope_counts_as_left_where_all_that_is_left_is_worth_next_to_nothing():
    # on so coarse a mesh each product is far above 1e-9, and all of them are 6e-7 of the objective
    spoilt = pushed_off(3e-4, intervals=20)
    slope = "between changes of 'go': dH/du"
    assert check_of(spoilt, slope).value < 1e-9
    without = with_costates(towards(20, upper=1 + 1e-3), 1 + 3e-4)
    assert slope in failed(without)


def test_a_stationary_point_that_is_no_minimum_fails():
    # int u^2 with a mean u of 1 has no maximum, but u = 1 is stationary for either sense; where it
    # is stated as a guess, no other start is made
    def stated(sense):
        x, u = State("x", "m"), Control("u", "m/s")
        phase = Phase("go", {x: u}, {x: 0}, {x: 1}, end=1.0, guess={x: (0, 1), u: 1})
        return Problem("go", [phase], **{sense: phase.integral(u**2)})

    assert failed(solve(stated("minimise"))) == set()
    assert failed(solve(stated("maximise"))) == {"a second solve", "other controls"}


def test_a_spoiled_control_fails():
    found = solved_on(10, least_effort(piecewise="constant"))
    own = found.trajectory.phases[0]
    states, controls = own.groups
    (piece,) = controls.polynomial.pieces
    piece = dataclasses.replace(piece, coefficients=piece.coefficients + 1e-3)
    polynomial = dataclasses.replace(controls.polynomial, pieces=(piece,))
    groups = (states, dataclasses.replace(controls, polynomial=polynomial))
    spoiled = dataclasses.replace(own, groups=groups)
    trajectory = dataclasses.replace(found.trajectory, phases=(spoiled,))
    assert "replay" in failed(dataclasses.replace(found, trajectory=trajectory))


def test_spoiled_multipliers_and_objectives_fail():
    found = solve(least_peak())
    iterate = found.kept_iterate
    rows = iterate.row_multipliers * np.where(np.arange(iterate.row_multipliers.size) % 2, 1.0, 1.1)
    spoilt = dataclasses.replace(iterate, row_multipliers=rows)
    assert "stationarity" in failed(dataclasses.replace(found, iterate=spoilt))
    spoilt = dataclasses.replace(found, objective=found.objective * 0.99)
    assert failed(spoilt) == {"objective"}


def test_an_iterate_that_is_not_the_best_fails():
    found = solved_on(10, least_effort())
    moved = dataclasses.replace(found.kept_iterate, x=found.kept_iterate.x * 1.01)
    assert {"constraint residuals", "stationarity"} <= failed(
        dataclasses.replace(found, iterate=moved)
    )


def test_a_certificate_is_printed():
    certificate = certify(solved_on(5, least_effort()))
    assert str(certificate).endswith("certified, confirmed by a second solve")
    assert all(c.sentence in str(certificate) for c in certificate.checks)


def test_without_multipliers():
    found = solved_on(5, least_effort())
    with pytest.raises(StatementError, match="multipliers"):
        certify(dataclasses.replace(found, multipliers=None, iterate=None))


# inside an interval, at two thirds of the time, and 1 % of the time beside a breakpoint
@pytest.mark.parametrize(("intervals", "brake", "off"), [(5, 2.0, 2), (3, 2.06, 10)])
def test_the_estimated_gain_of_finer_controls_is_a_condition(intervals, brake, off):
    coarse = solved_on(intervals, dash(lower=-brake))
    lost = coarse.objective / np.sqrt(600 * (1 + 1 / brake)) - 1
    assert lost > 1e-5
    estimate = check_of(coarse, "finer controls")
    assert estimate.failed
    # the estimate is of first order: it is not far from what is lost
    assert estimate.value == pytest.approx(lost, rel=off)


@pytest.mark.slow
def test_a_standstill_of_a_scheme_without_estimates_is_told():
    """The trapezoidal rule stood still 1.5e-3 below the longest way, and no word was said of it."""
    x, v, u, rates = double_integrator()
    fast = Bound("fast", v * (1 + 0.1 * x), upper=1.2)
    move = Phase("move", rates, {x: 0, v: 0}, {v: 0}, end=1.0, bounds=[fast])
    effort = Bound("effort", move.integral(u**2), upper=12.0)
    problem = Problem("far", move, maximise=move.at_end(x), bounds=[effort])
    stood = solve(problem, settings=Settings(scheme=Trapezoid()))
    right = stood.objective == pytest.approx(solve(problem).objective, rel=1e-5)
    told = "this scheme gives no estimate of a finer one" in stood.verdict
    assert told or right
    assert certify(stood).passed == right


@pytest.mark.parametrize("scheme", [HermiteSimpson(), Lobatto(3)])
def test_where_multipliers_tell_nothing_of_finer_controls_a_finer_mesh_does(scheme):
    refined = certify(solve(dash(), settings=Settings(scheme=scheme)))
    assert refined.passed, refined
    assert refined.confirmed

    # the best constant controls on this mesh meet all first-order conditions, and cost more
    coarse = solved_on(6, least_effort(piecewise="constant"), scheme=scheme)
    assert "gives no estimate of a finer one" in coarse.verdict
    lost = coarse.objective / 12.0 - 1
    assert lost > 1e-3
    assert failed(coarse) == {"a second solve"}
    assert check_of(coarse, "a second solve").value == pytest.approx(lost, rel=0.5)


def test_meshes_of_a_solve_that_agree_prove_nothing_of_intervals_that_neither_has_cut():
    """The trapezoidal scheme errs on all three arcs, and most intervals stay as they are."""
    settings = Settings(scheme=Trapezoid(), intervals=6, refinement=AdaptiveMesh(rounds=4))
    found = solve(bryson_denham(), settings=settings)
    error = abs(found.objective / 4.0 - 1)
    last, before = (entry.objective for entry in found.mesh_iterations[-1:-3:-1])
    assert abs(last - before) / 4.0 < 0.1 * error
    assert 0.5 * error < check_of(found, "a second solve").value < 5 * error


@pytest.mark.parametrize("scheme", [HermiteSimpson(), Lobatto()])
def test_a_worse_valley_is_refused_with_all_schemes(scheme):
    """The Hamiltonian has a valley at each of u = -1 and u = 1; the guess is in the worse one."""
    x, u = State("x"), Control("u", lower=-2, upper=2)
    phase = Phase("go", {x: u}, {x: 0}, end=1.0, guess={x: (0, -1), u: -1})
    gained = 0.3 * phase.at_end(x)
    problem = Problem("wells", phase, minimise=phase.integral((u**2 - 1) ** 2) - gained)
    found = solve(problem, settings=Settings(scheme=scheme))
    assert found.objective > 0  # of -0.305
    assert "other controls" in failed(found)


@pytest.mark.parametrize("scheme", [HermiteSimpson(), Lobatto(3)])
def test_an_exact_answer_on_one_mesh_is_certified_without_another(scheme):
    assert failed(solved_on(4, least_effort(), scheme=scheme)) == set()


def test_a_phase_of_no_length_is_certified():
    """All effort where a force gives more: 12 m^2/s^3 for a metre in a second from rest to rest."""
    x, v, u, rates = double_integrator(lower=-9, upper=9)
    meeting = Between(0, 5)
    strong = Phase("strong", rates, {x: 0, v: 0}, end=meeting)
    weak = Phase("weak", {x: v, v: u / 2}, final={x: 1, v: 0}, start=meeting, end=1.0)
    cost = strong.integral(u**2) + weak.integral(u**2)
    problem = Problem("two", [strong, weak], minimise=cost, links=joined(strong, weak))
    found = certified(problem, 12, within=1e-8)
    assert found.value(weak.duration) == pytest.approx(0, abs=1e-6)


def test_a_phase_that_does_not_matter_is_certified():
    """The peak is decided in a: 2 m/s^2 for a metre in a second from rest; b has three for the way
    to and fro.
    """
    x, v, u, rates = double_integrator(lower=-9, upper=9)
    a = Phase("a", rates, {x: 0, v: 0}, {x: 1}, end=1.0)
    b = Phase("b", rates, final={x: 1}, start=1.0, end=4.0)
    top = peak((a, u), (b, u), absolute=True)
    certified(Problem("one", [a, b], minimise=top, links=joined(a, b)), 2, within=1e-8)


def test_a_peak_of_zero_is_certified():
    x, v, _, rates = double_integrator(lower=-9, upper=9)
    stay = Phase("stay", rates, {x: 0, v: 0}, {x: 0}, end=1.0)
    certified(Problem("stay", stay, minimise=1 + stay.peak(x, absolute=True)), 1, within=1e-8)


@pytest.mark.parametrize(
    "cost",
    [
        lambda p, x, v, q, w: p.at_end(w**2 / 2 + 2 * q**2),
        lambda p, x, v, q, w: (p.at_end(x) - 1) ** 2 + p.at_end(v) ** 2 + p.at_end(q) ** 2,
        lambda p, x, v, q, w: p.integral(ca.fmax(0, v - 0.5) ** 2),
        lambda p, x, v, q, w: p.integral(ca.fmax(0, v - 0.5)),
    ],
    ids=["residual vibration", "missed end", "excess of speed", "kinked excess"],
)
def test_an_optimum_of_zero_is_certified(cost):
    """Many motions have it. Their costates are zero, and what a solver leaves of them says nothing.

    No switch of such a motion is at a wrong time either.
    """
    x, v, push, rates = double_integrator(lower=-1, upper=1)
    q, w = State("q", "m"), State("w", "m/s")
    rates |= {q: w, w: -4 * q - push}
    move = Phase("move", rates, dict.fromkeys(rates, 0), {x: 1, v: 0}, end=6.0)
    found = solve(Problem("quiet", move, minimise=cost(move, x, v, q, w)))
    assert found.objective == pytest.approx(0, abs=1e-9)
    assert "switch" not in str(found.verdict)
    assert certify(found).passed


def test_a_peak_of_which_less_is_not_better_is_named():
    _, v, u, move = rest_to_rest(lower=-9, upper=9)
    cost = (move.peak(v, name="top") - 2) ** 2 + 1e-3 * move.integral(u**2)
    with pytest.raises(Unverified, match=r"the peak 'top' is 2 in the objective, but 1\.5"):
        solve(Problem("fast", move, minimise=cost))


x, u = State("x", "m"), Control("u", "m/s")


def ride(final=None, **stated):
    times = {"end": Between(0.2, 9.0), "initial": {x: 0}, **stated}
    return Phase("ride", {x: u}, final={x: 1} if final is None else final, **times)


def peak_at_the_end():
    """Effort and the largest of t x: 1/T + T, half of the T by the value at the end."""
    phase = ride()
    moment = 0.5 * phase.at_end(TIME * x) + 0.5 * phase.peak(TIME * x)
    return Problem("late", phase, minimise=phase.integral(u**2) + moment)


def peak_at_the_start():
    """The same backwards: the largest of (1 - t) x is where the ride begins."""
    phase = ride({x: 0}, start=Between(-3.0, 0.8), end=1.0, initial={x: 1})
    return Problem("early", phase, minimise=phase.integral(u**2) + phase.peak(x * (1 - TIME)))


def limit_at_the_end():
    """At the end x + t <= 2 acts: (u^2 + 1 - 3 u) T with T = 2 / (1 + u), u = sqrt(5) - 1."""
    phase = ride({}, bounds=[Bound("closing gate", x + TIME, upper=2)])
    return Problem("gate", phase, minimise=phase.integral(u**2 + 1) - 3 * phase.at_end(x))


@pytest.mark.parametrize(
    ("problem", "optimum", "end"),
    [
        (peak_at_the_end(), 2.0, "end"),
        (peak_at_the_start(), 2.0, "start"),
        (limit_at_the_end(), 4 * math.sqrt(5) - 10, "end"),
    ],
    ids=["peak at the end", "peak at the start", "limit at the end"],
)
def test_what_acts_at_a_free_time_counts_with_its_slope_by_time(problem, optimum, end):
    found = certified(problem, optimum, within=1e-7)
    # and a costate that is off by a hundredth is still told
    assert f"Hamiltonian at the {end} of 'ride'" in failed(with_costates(found, 1.01))


def told(solution, **options):
    (finding,) = certify(solution, diagnostics=[partial(confirm, **options)]).checks
    return finding


@pytest.mark.parametrize("scheme", [Radau(), Gauss(), HermiteSimpson()])
def test_a_right_answer_is_confirmed_whatever_its_scheme(scheme):
    x, v, u, rates = double_integrator()
    speed = Bound("speed", v, upper=1.3)
    move = Phase("move", rates, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0, bounds=[speed])
    problem = Problem("slow", move, minimise=move.integral(u**2))
    certificate = certify(solve(problem, settings=Settings(scheme=scheme)))
    assert certificate.confirmed, certificate
    assert certificate.start is None


def test_a_coarse_answer_is_refused_with_a_better_start():
    problem = least_effort(piecewise="constant")
    coarse = solved_on(5, problem)
    lost = coarse.objective / 12.0 - 1
    certificate = certify(coarse, diagnostics=[confirm])
    assert not certificate.passed
    assert certificate.checks[0].value == pytest.approx(lost, rel=0.5)
    # what it found is on its own mesh
    fixed = Settings(intervals=5, refinement=FixedMesh())
    again = solve(problem, settings=fixed, guess=certificate.start)
    assert again.objective == pytest.approx(coarse.objective, rel=1e-6)
    assert solve(problem, guess=certificate.start).objective < coarse.objective * (1 - 0.9 * lost)


def test_a_maximum_that_is_stationary_is_left_to_both_sides():
    """A motion that rests on a ridge, and gains by leaving it to either side."""
    y, a = State("y"), Control("a", lower=-3, upper=3)
    guess = {y: 0, a: 0}
    phase = Phase("ridge", {y: a}, {y: 0}, {y: 0}, end=2.0, guess=guess)
    problem = Problem("ridge", phase, minimise=phase.integral(0.1 * a**2 - y**2 + 0.2 * y**4))
    found = solve(problem, settings=Settings(refinement=FixedMesh()))
    certificate = certify(found, diagnostics=[confirm])
    assert certificate.confirmed == (found.objective < -1.0)  # and 0 on the ridge
    assert (certificate.start is None) == certificate.confirmed


@dataclasses.dataclass(frozen=True)
class Recording:
    """A solver of a user, which tells how it was started, and may change what came of it."""

    inner: Ipopt
    starts: list
    changes: Any

    def solve(self, program, start, limits, parameters, listener=None):
        self.starts.append((program, start))
        result = self.inner.solve(program, start, limits, parameters, listener)
        changes = self.changes(result) if callable(self.changes) else self.changes
        return dataclasses.replace(result, **changes)

    def within(self, iterations, seconds):
        return dataclasses.replace(self, inner=self.inner.within(iterations, seconds))

    def loosened(self, tolerance):
        return self

    def within_gap(self, gap):
        return self

    def alternatives(self, *, warm):
        return ()


def test_nothing_is_taken_over_but_the_motion():
    found = solve(dash())
    solver = Recording(Ipopt(), [], {})
    assert isinstance(solver, NlpSolver)
    assert told(found, solver=solver).passed
    own = found.kept_iterate
    assert any(phase.movable for phase in own.mesh.phases)
    points = [start.x for _, start in solver.starts]
    assert all(start.multipliers is None for _, start in solver.starts)
    assert all(program.variables > 1.5 * own.x.size for program, _ in solver.starts)
    # beside the motion, to both sides
    assert len(points) == 2
    assert np.abs(points[0] - points[1]).max() > 1e-2


@pytest.mark.parametrize(
    ("outcome", "state"),
    [("failed", "open"), ("budget", "open"), ("infeasible", "failed"), ("unbounded", "failed")],
)
def test_what_comes_to_no_end_is_open_and_no_motion_beside_an_answer_refuses_it(outcome, state):
    finding = told(solve(least_effort()), solver=Recording(Ipopt(), [], {"outcome": outcome}))
    states = {"open": finding.open, "passed": finding.passed, "failed": finding.failed}
    assert [name for name, holds in states.items() if holds] == [state]
    assert state == "failed" or outcome in finding.sentence


def test_worse_motions_say_nothing():
    def worse(result):
        return {"x": 1.5 * result.x, "row_multipliers": 0.0 * result.row_multipliers}

    finding = told(solve(least_effort()), solver=Recording(Ipopt(), [], worse))
    assert finding.open
    assert "worse" in finding.sentence


def test_a_budget_leaves_it_open_and_the_certificate_unconfirmed():
    asked = [partial(confirm, seconds=1e-9) if one is confirm else one for one in STANDARD]
    certificate = certify(solve(least_effort()), diagnostics=asked)
    assert certificate.passed
    assert not certificate.confirmed
    assert "open  a second solve: no run from a perturbed start" in str(certificate)
    assert [check.name for check in certificate.checks if check.open] == ["a second solve"]


def test_a_stop_of_the_user_stops_it():
    with pytest.raises(KeyboardInterrupt):
        told(solve(least_effort()), solver=Recording(Ipopt(), [], {"outcome": "interrupted"}))


def test_progress_is_told():
    lines = []
    told(solve(least_effort()), progress=lines.append)
    assert lines[0] == "least effort: a second solve, run 1"


@pytest.mark.parametrize(
    ("diagnostics", "words"),
    [
        (confirm, "diagnostics is one function; write a list"),
        ("confirm", "diagnostics is 'confirm'; give a list of functions"),
        ([1.0], r"diagnostics is \[1.0\]; give a list of functions"),
        ([lambda answer: None], "'<lambda>' gave None; let it yield Finding"),
        ([lambda answer: [0.5]], r"'<lambda>' gave \[0.5\]; let it yield Finding"),
    ],
)
def test_what_is_no_diagnostic_is_told(diagnostics, words):
    with pytest.raises(StatementError, match=words):
        certify(solve(least_effort()), diagnostics=diagnostics)


def landing(height, duration):
    """A mass that falls at 1 m/s from 0, and has to turn before a floor; then it is free to rise.

    The least effort is 4 / (9 height), with the jerk constant until the floor is touched at rest:
    A. E. Bryson and Y.-C. Ho, "Applied Optimal Control", sec. 3.11, one half of the symmetric
    motion, in which the integrand has a factor of one half.
    """
    x, v, u = State("x", "m", lower=-height), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("land", {x: v, v: u}, {x: 0, v: -1}, end=duration)
    return Problem("landing", phase, minimise=phase.integral(u**2))


@pytest.mark.parametrize("height", [1e-2, 1e-3, 1e-4])
def test_a_floor_far_smaller_than_the_motion_is_kept(height):
    found = certified(landing(height, 10.0), 4 / (9 * height))
    times = np.concatenate([np.linspace(0, 20 * height, 20_001), np.linspace(0, 10, 20_001)])
    # the worth of this excess is the same part of the effort
    assert -found.sample("x", times).min() == pytest.approx(height, rel=1e-5)


def test_the_worth_is_what_the_effort_changes_with_the_floor():
    """The effort is as one over the height, so that their changes are the same parts."""
    found = solved_on(10, landing(0.1, 2.0))
    deepest = -found.sample("x", np.linspace(0, 2, 20_001)).min()
    worth = check_of(found, "effect of the excess").value
    assert worth == pytest.approx(deepest / 0.1 - 1, rel=0.1)


def test_a_small_excess_of_much_worth_is_not_certified():
    found = solved_on(40, landing(1e-2, 10.0))
    assert check_of(found, "path constraints").value < 1e-5
    worth = check_of(found, "effect of the excess")
    assert worth.value > 1e-3
    assert not worth.passed
