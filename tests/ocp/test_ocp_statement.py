"""Ill-posed statements are refused in words: the thing, the value, the remedy."""

import math

import casadi as ca
import numpy as np
import pytest

from ocp import (
    Accuracy,
    Algebraic,
    Between,
    Bound,
    Constant,
    Control,
    Phase,
    Problem,
    Settings,
    State,
    StatementError,
    Unknown,
    peak,
    solve,
    solve_lexicographic,
)
from ocp.mesh.mesh import PhaseMesh, uniform

x, v, other = State("x", "m"), State("v", "m/s", lower=-1, upper=2), State("other")
u, twin = Control("u", "m/s^2"), Control("u", "m/s^2")
z, k = Algebraic("z"), Unknown("k")
RATES = {x: v, v: u}


def move(**options):
    return Phase("move", RATES, **{"end": 1.0, **options})


def limited(factor=1, **limits):
    phase = move()
    bound = Bound("fast", factor * phase.peak(v, name="speed"), **limits)
    return Problem("task", [phase], minimise=phase.integral(u**2), links=[bound])


def minimise(phase, objective):
    return Problem("task", [phase], minimise=objective)


ILL_POSED = {
    "boundary value outside the bounds": (
        lambda: move(initial={v: 5.0}),
        r"initial value 5.0 of 'v'.*\[-1, 2\].*change one",
    ),
    "boundary value without dynamics": (
        lambda: move(final={other: 1.0}),
        r"final value.*'other'.*no dynamics.*add its derivative",
    ),
    "boundary pair the wrong way round": (
        lambda: move(initial={x: (2.0, 1.0)}),
        r"initial x.*2.0.*1.0.*swap",
    ),
    "boundary triple": (
        lambda: move(initial={x: (0.0, 1.0, 2.0)}),
        r"initial value of 'x'.*give a number or a",
    ),
    "a state without dynamics": (
        lambda: Phase("move", {x: v}, end=1.0),
        r"'move' uses the state 'v'.*no dynamics.*add",
    ),
    "dynamics of a control": (
        lambda: Phase("move", {u: x}, end=1.0),
        r"dynamics of phase 'move'.*no State",
    ),
    "crossed bounds of a signal": (
        lambda: State("h", lower=3, upper=2),
        r"'h' cross: lower 3 is above upper 2; swap",
    ),
    "crossed bounds of a bound": (
        lambda: Bound("room", x, lower=1, upper=-1),
        r"'room' cross: lower 1 .* -1; swap",
    ),
    "a bound without limits": (lambda: Bound("room", x), r"'room' has neither.*give one"),
    "a bound that is no number": (
        lambda: Bound("room", x, lower="1 m"),
        r"'room' is '1 m'; give a number",
    ),
    "a NaN bound": (lambda: Control("thrust", upper=math.nan), r"'thrust' is nan; give a number"),
    "a negative scale": (lambda: State("h", scale=-2.0), r"scale of 'h' is -2.0; give a positive"),
    "a constant without a value": (
        lambda: Constant("mass", "kg"),
        r"'mass' is nan; give it a finite",
    ),
    "an undeclared symbol": (
        lambda: Phase("move", {x: ca.SX.sym("stray")}, end=1.0),
        r"derivative of 'x' in 'move'.*'stray'.*declare it",
    ),
    "a vector": (
        lambda: Bound("both", ca.vertcat(x, v), upper=1),
        r"'both' has shape 2x1; give one scalar",
    ),
    "a vector as a derivative": (
        lambda: Phase("move", {x: ca.vertcat(1, 2)}, end=1.0),
        r"derivative of 'x' has shape 2x1",
    ),
    "a string as a derivative": (
        lambda: Phase("move", {x: "v"}, end=1.0),
        r"derivative of 'x' is 'v', not a CasADi",
    ),
    "an end before the start": (
        lambda: move(start=3.0, end=2.0),
        r"'move' ends at 2.0 s, not after its start at 3.0 s",
    ),
    "free times the wrong way round": (lambda: Between(5, 1), r"free time.*5.*1; swap"),
    "a guess outside a free time": (
        lambda: Between(1, 2, 3),
        r"guess 3 .*outside \[1, 2\]; give a guess between",
    ),
    "an endless phase": (
        lambda: move(end=math.inf),
        r"end of phase 'move' is inf; give a finite number",
    ),
    "an instant outside its phase": (
        lambda: move(end=2.0).at(3.0, x),
        r"3.0 s lies outside phase 'move' \(0.0 to 2.0 s\)",
    ),
    "an instant of a phase with a free end": (
        lambda: move(end=Between(1, 2)).at(1.0, x),
        r"needs fixed times.*'move'.*split the phase",
    ),
    "a peak of nothing": (lambda: peak(name="load"), r"'load' has no.*give one"),
    "no objective": (
        lambda: Problem("task", [move()]),
        r"'task' needs exactly one of minimise and maximise",
    ),
    "two objectives": (
        lambda: Problem("task", [move()], minimise=0, maximise=0),
        r"'task' needs exactly one",
    ),
    "a signal in the objective": (
        lambda: minimise(move(), x**2),
        r"'task' uses the signal 'x'.*wrap it in at_start",
    ),
    "a vector as the objective": (
        lambda: minimise(move(), ca.SX(2, 1)),
        r"objective has shape 2x1",
    ),
    "two states of one name": (
        lambda: minimise(Phase("move", {x: 1, State("x"): 2}, end=1.0), 0),
        r"signal called 'x'; rename",
    ),
    "two controls of one name": (
        lambda: minimise(Phase("move", {x: u + twin}, end=1.0), 0),
        r"signal called 'u'; rename",
    ),
    "a state and a control of one name": (
        lambda: minimise(Phase("move", {x: Control("x")}, end=1.0), 0),
        r"signal called 'x'; rename",
    ),
    "a peak limited from below": (
        lambda: limited(lower=0.5),
        r"'fast' asks for a large peak 'speed'.*from above",
    ),
    "a peak limited from below by a constant": (
        lambda: limited(lower=Constant("least", value=0.5)),
        r"'fast' asks for a large peak",
    ),
    "a negative peak limited from above": (
        lambda: limited(-1, upper=-0.5),
        r"'fast' asks for a large peak",
    ),
    "a peak to maximise": (
        lambda: Problem("task", [moved := move()], maximise=moved.at_end(x) + moved.peak(v)),
        r"objective asks for a large peak",
    ),
    "a fixed objective": (
        lambda: minimise(move(), 3.0),
        r"objective of problem 'task' is a fixed number",
    ),
    "no phase": (lambda: Problem("task", [], minimise=k), r"'task' has no phase"),
    "a boundary value that is a signal": (
        lambda: move(initial={x: u}),
        r"initial value of 'x' depends on 'u'",
    ),
    "a bound that is a signal": (
        lambda: minimise(moved := move(bounds=[Bound("b", u, upper=x)]), moved.at_end(x)),
        r"upper limit of 'b' depends on 'x'",
    ),
    "a boundary pair outside the bounds": (
        lambda: move(initial={v: (3.0, 4.0)}),
        r"initial value \(3.0, 4.0\) of 'v' lies outside",
    ),
    "two phases of one name": (
        lambda: Problem("task", [move(), move()], minimise=0),
        r"phase called 'move'; rename",
    ),
    "a functional of a foreign phase": (
        lambda: minimise(move(), Phase("else", {other: 1}, end=1.0).at_end(other)),
        r"belongs to phase 'else'.*'task' does not have; add the phase",
    ),
    "a functional inside dynamics": (
        lambda: Phase("next", {other: move().at_end(x)}, end=1.0),
        r"'next'.*Unknown linked by a Bound",
    ),
    "a mesh of no intervals": (lambda: uniform(0, 3), r"0 intervals is impossible; ask for 1"),
    "a mesh that starts late": (lambda: PhaseMesh(np.array([0.1, 1.0]), 3), r"run from 0 to 1"),
    "a repeated breakpoint": (
        lambda: PhaseMesh(np.array([0, 0.5, 0.5, 1.0]), 3),
        r"must increase; remove",
    ),
    "a movable end": (
        lambda: PhaseMesh(np.array([0, 0.5, 1.0]), 3, (2,)),
        r"only inner breakpoints.*\(2,\)",
    ),
    "a negative number of intervals": (
        lambda: Settings(intervals=-3),
        r"'intervals' is -3; give a positive integer",
    ),
    "a tolerance of zero": (
        lambda: Settings(accuracy=Accuracy(path=0.0)),
        r"'path' is 0.0; give a positive number",
    ),
    "an unknown shape": (
        lambda: Settings(controls="cubic"),
        r"'controls' is 'cubic'; choose one of constant, linear, polynomial, automatic, full",
    ),
    "no objective to order": (
        lambda: solve_lexicographic(minimise(moved := move(), moved.at_end(x)), []),
        r"at least one objective",
    ),
}


@pytest.mark.parametrize("case", ILL_POSED)
def test_an_ill_posed_statement_is_refused(case):
    state, words = ILL_POSED[case]
    with pytest.raises(StatementError, match=words):
        state()


pushed = Phase("move", RATES, initial={x: 0, v: 0}, final={x: 1}, end=1.0)
REFUSED_BY_SOLVE = {
    "a constant that the problem lacks": (
        minimise(pushed, pushed.integral(u**2)),
        {"constants": {Constant("mass", "kg", 1.0): 2.0}},
        r"'task' does not use the constant 'mass'",
    ),
}


@pytest.mark.parametrize("case", REFUSED_BY_SOLVE)
def test_solve_refuses(case):
    problem, options, words = REFUSED_BY_SOLVE[case]
    with pytest.raises(StatementError, match=words):
        solve(problem, **options)


@pytest.mark.parametrize(
    ("guess", "words"),
    [
        (math.nan, r"guess of 'x' in phase 'move' is not finite at 0 s; give finite"),
        (
            lambda t: np.sqrt(t - 0.5 + 0j).real / (t < 2) * np.where(t < 0.5, np.nan, 1),
            r"guess of 'x'.*not finite at 0 s",
        ),
        (([0, 1, 1], [1, 2, 3]), r"guess of 'x' needs.*increasing times"),
    ],
)
def test_an_impossible_guess_is_refused(guess, words):
    phase = Phase("move", RATES, initial={x: 0, v: 0}, final={x: 1}, guess={x: guess}, end=1.0)
    with pytest.raises(StatementError, match=words):
        solve(minimise(phase, phase.integral(u**2)))


def test_a_free_time_without_limits_needs_a_guess():
    phase = Phase("move", RATES, initial={x: 0, v: 0}, final={x: 1}, end=Between(0.1, math.inf))
    with pytest.raises(StatementError, match=r"between 0.1 and inf needs a guess"):
        solve(minimise(phase, phase.end_time))


def test_a_problem_knows_its_symbols():
    phase = Phase("move", {x: u, other: z + k}, initial={x: 0}, end=1.0)
    problem = minimise(phase, phase.at_end(x))
    assert {s.name for s in problem.symbols} >= {"x", "u", "z", "k", "other"}
    assert problem.unknowns == (k,)
    assert problem.algebraics[phase.name] == (z,)


def test_a_signal_is_no_number():
    small = Phase("small", {x: u}, initial={x: 0}, final={x: 1}, end=1.0)
    found = solve(minimise(small, small.integral(u**2)), settings=Settings(intervals=2))
    with pytest.raises(StatementError, match=r"'x' varies in time; sample it"):
        found.value(x)
    with pytest.raises(StatementError, match=r"7.0 s lies outside the motion \(0.0 to 1.0 s\)"):
        found.sample(x, 7.0)
