"""A mistake in a statement or a call is answered in one sentence with thing, value and remedy."""

import copy
import dataclasses
import math
import pickle

import casadi as ca
import numpy as np
import pytest

from ocp import (
    Accuracy,
    AdaptiveMesh,
    Algebraic,
    Between,
    Bound,
    Constant,
    Control,
    FixedMesh,
    Gauss,
    Infeasible,
    Interpolant,
    Ipopt,
    Lobatto,
    MovingMesh,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    StatementError,
    StatementWarning,
    Tolerances,
    Unknown,
    audit,
    certify,
    homotopy,
    joined,
    peak,
    save,
    scaling_report,
    solve,
    solve_lexicographic,
    with_objective,
)
from ocp.mesh.mesh import PhaseMesh, uniform
from ocp.numerics.schemes import Trapezoid
from ocp.problem.checks_before_solve import check_before_solve
from ocp.problem.parameters import parameters_of

x, v = State("position", "m"), State("speed", "m/s")
u = Control("force", "N", lower=-4, upper=4)
RATES = {x: v, v: u}
START, GOAL = {x: 0, v: 0}, {x: 1, v: 0}


def drive(**changed):
    stated = {"dynamics": RATES, "initial": START, "final": GOAL, "end": 2.0}
    return Phase("drive", **{**stated, **changed})


PUSH = Phase("push", RATES, initial=START, end=1.0)
REST = Phase("rest", RATES, final=GOAL, start=1.0, end=2.0)
MOST = Unknown("most", lower=0)
PUSHED = Control("pushed", "N", lower=0, upper=MOST)


def priced(phase, control):
    """A problem in whose objective alone a control is."""
    return Problem("priced", phase, minimise=phase.integral(u**2 + control**2))


def task(phase, **changed):
    return Problem("task", phase, **{"minimise": phase.integral(u**2), **changed})


def solving(**options):
    """A solve with such options."""
    return lambda: solve(task(drive()), **options)


def guessed(guess):
    """A solve from a guess of the position."""
    return lambda: solve(task(drive(guess={x: guess})))


X, V, other = State("x", "m"), State("v", "m/s", lower=-1, upper=2), State("other")
U, twin = Control("u", "m/s^2"), Control("u", "m/s^2")
z, k = Algebraic("z"), Unknown("k")
MOVED = {X: V, V: U}


def move(**options):
    return Phase("move", MOVED, **{"end": 1.0, **options})


def limited(factor=1, **limits):
    phase = move()
    bound = Bound("fast", factor * phase.peak(V, name="speed"), **limits)
    return Problem("task", [phase], minimise=phase.integral(U**2), links=[bound])


def minimise(phase, objective):
    return Problem("task", [phase], minimise=objective)


def with_end(value):
    q, u = State("q", shape=2), Control("u", shape=2)
    return Phase("p", {q: u}, final={q: value}, end=1.0)


# The sentence that answers, and what it answers.
MISUSES = [
    # keywords
    (r"State .* 'uper'; did you mean 'upper'", lambda: State("h", uper=1)),
    (r"State .* 'min'; write lower=2$", lambda: State("h", min=2)),
    (r"State .* 'initial'; .*Phase\(initial=\{state: 2\}\)", lambda: State("h", initial=2)),
    (r"Control .* 'piecwise'; did you mean 'piecewise'", lambda: Control("f", piecwise="linear")),
    (r"Algebraic .* 'ub'; write upper=3$", lambda: Algebraic("z", ub=3)),
    (r"Unknown .* 'initial'; write guess=3$", lambda: Unknown("k", initial=3)),
    (r"Constant .* 'val'; write value=3$", lambda: Constant("k", val=3)),
    (r"Between .* 'initial'; write guess=1.5$", lambda: Between(1, 2, initial=1.5)),
    (r"Bound .* 'max'; write upper=3$", lambda: Bound("room", x, max=3)),
    (r"Phase .* did you mean 'dynamics'", lambda: Phase("p", dynamic=RATES, end=1.0)),
    (
        r"Phase has no 'end'; write Phase\(name, dynamics, end=...\); initial, final",
        lambda: Phase("p", dynamics=RATES),
    ),
    (
        r"Phase .* 'duration'; write end=3, or end=Between\(lower, upper\)",
        lambda: drive(duration=3),
    ),
    (r"Phase .* 'constraints'; write bounds=\[...\]", lambda: drive(constraints=[])),
    (r"did you mean 'minimise'", lambda: Problem("p", drive(), minimize=0)),
    (r"'cost'; write minimise=", lambda: Problem("p", drive(), cost=0)),
    (r"Settings .* did you mean 'intervals'", lambda: Settings(interval=3)),
    (r"'tol'; write accuracy=", lambda: Settings(tol=1e-6)),
    (r"solve .* 'verbose'; write progress=True", solving(verbose=True)),
    (r"solve .* 'intervals'; .*settings=Settings\(...\)", solving(intervals=30)),
    (r"solve .* did you mean 'settings'", solving(setting=0)),
    (r"integral .* did you mean 'unit'", lambda: drive().integral(u, units="N")),
    (r"peak .* did you mean 'absolute'", lambda: peak((drive(), u), absolut=True)),
    (r"did you mean 'absolute'", lambda: drive().peak(u, absolut=True)),
    (r"did you mean 'weights'", lambda: drive().misfit(x, [0], [1], weight=2)),
    # what is left out
    (r"Phase has no 'name'; write Phase\(name, dynamics", lambda: Phase(dynamics=RATES, end=1.0)),
    (r"Problem has no 'phases'; write Problem", lambda: Problem(drive(), minimise=0)),
    (r"Bound has no 'expression'", lambda: Bound("room", upper=1)),
    # values of another kind
    (
        r"'drive' is a phase, which has no objective; write Problem\('drive', phase, minimise",
        lambda: solve(drive()),
    ),
    (r"is of type list; give a Problem\(name, phases", lambda: solve([drive()])),
    (r"'drive' is a phase, which has no", lambda: scaling_report(drive())),
    (r"'drive' is a phase, which has no", lambda: with_objective(drive(), 0)),
    (r"a Solution, not .*solve it first", lambda: certify(task(drive()))),
    (r"'push' with itself; give the phase", lambda: joined(PUSH, PUSH)),
    (
        r"into phase 'rest' is of 'speed', which is not a state of this phase; give a State object",
        lambda: joined(PUSH, REST, jump={"speed": v / 2}),
    ),
    (
        r"is of 'height', which is not a state of this phase; give .* one of position, speed",
        lambda: joined(PUSH, REST, jump={State("height"): v / 2}),
    ),
    (
        r"'late' cannot begin when phase 'push' ends: it starts at 2.5 s, but 'push' ends at",
        lambda: joined(PUSH, Phase("late", RATES, start=2.5, end=3.0)),
    ),
    (
        r"becomes the bound 'pushed upper' of phase 'drive', but another bound has this.* rename",
        lambda: drive(dynamics={x: v, v: PUSHED}, bounds=[Bound("pushed upper", v, upper=9)]),
    ),
    (
        r"the limit of 'pushed' depends on an unknown, but phase 'drive' has 'pushed' in an int",
        lambda: priced(drive(), PUSHED),
    ),
    (
        r"the problem has no Unknown 'most'; there are: none",
        lambda: solve(task(drive())).value(MOST),
    ),
    (
        r"'task' does not use the constant 'load'; there are: none",
        lambda: homotopy(task(drive()), Constant("load", value=1), 2),
    ),
    (r"'all'; give a whole number", lambda: audit(task(drive()), starts="all")),
    (r"'bound' is 'low'; give a finite nu", solving(bound="low")),
    (r"one is 'next'; write joined\(first", lambda: joined(drive(), "next")),
    (r"phase of .* is 'drive'; give", lambda: Problem("p", "drive", minimise=0)),
    (
        r"'dynamics' of phase 'drive' is \[.*dynamics=\{state: expression\}",
        lambda: drive(dynamics=[v, u]),
    ),
    (r"'final' of phase .* is \[1, 0\]; give", lambda: drive(final=[1, 0])),
    (r"'final position' is '1'; give a num", lambda: drive(final={x: "1"})),
    (r"is \[1, 2\]; give a number or a pair", lambda: drive(final={x: [1, 2]})),
    (r"a final value for 'position' .*give the State object", lambda: drive(final={"position": 1})),
    (r"a final value for 'force' .*phase.at_end\(force\)", lambda: drive(final={u: 1})),
    (
        r"a guess for 'position'.*give the signal itself",
        lambda: solve(task(drive(guess={"position": 1}))),
    ),
    (r"unit of 'h' is 0; give a text .*lower=", lambda: State("h", 0, 1)),
    (r"bound of 'h' is \(0, 1\); give a num", lambda: State("h", upper=(0, 1))),
    (r"bound of 'h' is None; .* leave it out", lambda: State("h", upper=None)),
    (r"guess of 'k' is '1'; give a finite", lambda: Unknown("k", guess="1")),
    (r"scale of 'h' is '1'; give a positive", lambda: State("h", scale="1")),
    (
        r"objective is 'time', not a CasADi SX expression; give one expression of signals",
        lambda: task(drive(), minimise="time"),
    ),
    (r"objective is <bound .*; call it", lambda: task(drive(), minimise=drive().integral)),
    (
        r"uses the signal 'speed' as if it were a number; wrap it in at_start",
        lambda: task(drive(), minimise=v),
    ),
    (
        r"objective .* is the relation .*; minimise one number, and give relations as bounds",
        lambda: task(drive(), minimise=drive().integral(u) <= 3),
    ),
    (
        r"an entry of the peak 'peak' is Phase.*; write phase.peak\(expression\)",
        lambda: peak(drive(), u),
    ),
    (
        r"the integral contains 'load', which is itself a number of the whole motion",
        lambda: drive().integral(drive().peak(u, name="load")),
    ),
    (
        r"an instant of phase 'drive' is State\(.*; write phase.at\(instant, expression\)",
        lambda: drive().at(x, 1.0),
    ),
    (r"name of a phase is \{.*give a text", lambda: Phase(RATES, "drive", end=1.0)),
    (r"name of a problem is 1; give a text", lambda: Problem(1, drive(), minimise=0)),
    (r"name of a bound is State\(.*give a text", lambda: Bound(x, "room", upper=1)),
    (r"unit of 'room' is 0; give a text .*lower=", lambda: Bound("room", x, 0, 1)),
    (r"guess '1.5' of a free time", lambda: Between(1, 2, "1.5")),
    (r"'jump' .* is 3; give a dict", lambda: joined(drive(), drive(), jump=3)),
    (r"'constants' is \[3\]; give a dictionary", solving(constants=[3])),
    (r"an MX cannot be combined .* of type SX", lambda: drive().integral(ca.MX.sym("k"))),
    (r"argument 'bound' is nan; give a finite number", solving(bound=math.nan)),
    (r"argument 'bound' is -inf; give a finite number", solving(bound=-math.inf)),
    (r"'settings' is of type dict; write", solving(settings={})),
    (r"'guess' is of type tuple; .*Phase\(g", solving(guess=(0, 1))),
    (r"'mesh' is of type int; give a Mesh", solving(mesh=20)),
    (r"'problem' is of type int; give a Problem", lambda: solve(3)),
    (r"progress is 1; give True", solving(progress=1)),
    (r"limit of a free time is Unknown.*Bound\('end'", lambda: Between(0.1, MOST)),
    # symbols as if they were numbers
    (r"'0<position' is neither true .*ca.if_else.* of if$", lambda: 1 if x > 0 else 2),
    (r"neither true nor false", lambda: max(x, v)),
    (r"neither true nor false.*one by one.*ca.if_else", lambda: -1 <= x <= 1),
    (r"neither true nor false.*one by one.*ca.if_else", lambda: x == 1 and v == 2),
    (r"ca.if_else\(.*\) instead of np.where$", lambda: np.where(x > 0, 1, 2)),
    (r"'position' is a symbol, not a number; write ca.sin", lambda: math.sin(x)),
    (r"'k' is a symbol, not .*solution.value", lambda: float(Unknown("k"))),
    # statements that are ill-posed
    (r"initial value 5.0 of 'v'.*\[-1, 2\].*change one", lambda: move(initial={V: 5.0})),
    (r"final value.*'other'.*no dynamics.*add its derivative", lambda: move(final={other: 1.0})),
    (r"initial x.*2.0.*1.0.*swap", lambda: move(initial={X: (2.0, 1.0)})),
    (r"initial value of 'x'.*give a number or a", lambda: move(initial={X: (0.0, 1.0, 2.0)})),
    (r"'move' uses the state 'v'.*no dynamics.*add", lambda: Phase("move", {X: V}, end=1.0)),
    (r"dynamics of phase 'move'.*not a State", lambda: Phase("move", {U: X}, end=1.0)),
    (
        r"'h' contradict each other: lower 3 is above upper 2; swap",
        lambda: State("h", lower=3, upper=2),
    ),
    (
        r"'room' contradict each other: lower 1 .* -1; swap",
        lambda: Bound("room", X, lower=1, upper=-1),
    ),
    (r"'room' has neither.*give one", lambda: Bound("room", X)),
    (r"'room' is '1 m'; give a number", lambda: Bound("room", X, lower="1 m")),
    (r"'thrust' is nan; give a number", lambda: Control("thrust", upper=math.nan)),
    (r"scale of 'h' is -2.0; give a positive", lambda: State("h", scale=-2.0)),
    (r"'mass' is nan; give it a finite", lambda: Constant("mass", "kg")),
    (
        r"derivative of 'x' in 'move'.*'stray'.*declare it",
        lambda: Phase("move", {X: ca.SX.sym("stray")}, end=1.0),
    ),
    (r"'both' has shape 2x1; give one scalar", lambda: Bound("both", ca.vertcat(X, V), upper=1)),
    (r"derivative of 'x' has shape 2x1", lambda: Phase("move", {X: ca.vertcat(1, 2)}, end=1.0)),
    (r"derivative of 'x' is 'v', not a CasADi", lambda: Phase("move", {X: "v"}, end=1.0)),
    (r"'move' ends at 2.0 s, not after its start at 3.0 s", lambda: move(start=3.0, end=2.0)),
    (r"free time.*5.*1; swap", lambda: Between(5, 1)),
    (r"guess 3 .*outside \[1, 2\]; give a guess between", lambda: Between(1, 2, 3)),
    (r"end of phase 'move' is inf; give a finite number", lambda: move(end=math.inf)),
    (r"3.0 s lies outside phase 'move' \(0.0 to 2.0 s\)", lambda: move(end=2.0).at(3.0, X)),
    (r"needs fixed times.*'move'.*split the phase", lambda: move(end=Between(1, 2)).at(1.0, X)),
    (r"'load' has no.*give at least one", lambda: peak(name="load")),
    (r"'task' needs exactly one of minimise and maximise", lambda: Problem("task", [move()])),
    (r"'task' needs exactly one", lambda: Problem("task", [move()], minimise=0, maximise=0)),
    (r"'task' uses the signal 'x'.*wrap it in at_start", lambda: minimise(move(), X**2)),
    (r"objective has shape 2x1", lambda: minimise(move(), ca.SX(2, 1))),
    (
        r"signal called 'x'; rename",
        lambda: minimise(Phase("move", {X: 1, State("x"): 2}, end=1.0), 0),
    ),
    (r"signal called 'u'; rename", lambda: minimise(Phase("move", {X: U + twin}, end=1.0), 0)),
    (r"signal called 'x'; rename", lambda: minimise(Phase("move", {X: Control("x")}, end=1.0), 0)),
    (r"'fast' requires a large peak 'speed'.*from above", lambda: limited(lower=0.5)),
    (r"'fast' requires a large peak", lambda: limited(lower=Constant("least", value=0.5))),
    (r"'fast' requires a large peak", lambda: limited(-1, upper=-0.5)),
    (
        r"objective requires a large peak",
        lambda: Problem("task", [moved := move()], maximise=moved.at_end(X) + moved.peak(V)),
    ),
    (r"objective of problem 'task' is a fixed number", lambda: minimise(move(), 3.0)),
    (r"'task' has no phase", lambda: Problem("task", [], minimise=k)),
    (r"initial value of 'x' depends on 'u'", lambda: move(initial={X: U})),
    (
        r"upper limit of 'b' depends on 'x'",
        lambda: minimise(moved := move(bounds=[Bound("b", U, upper=X)]), moved.at_end(X)),
    ),
    (r"initial value \(3.0, 4.0\) of 'v' lies outside", lambda: move(initial={V: (3.0, 4.0)})),
    (r"phase called 'move'; rename", lambda: Problem("task", [move(), move()], minimise=0)),
    (
        r"belongs to phase 'else'.*'task' does not have; add the phase",
        lambda: minimise(move(), Phase("else", {other: 1}, end=1.0).at_end(other)),
    ),
    (
        r"'next'.*an Unknown there, and link it by a Bound",
        lambda: Phase("next", {other: move().at_end(X)}, end=1.0),
    ),
    (r"the number of intervals of a mesh is 0; give 1", lambda: uniform(0, 3)),
    (r"run from 0 to 1", lambda: PhaseMesh(np.array([0.1, 1.0]), 3)),
    (r"must increase; remove", lambda: PhaseMesh(np.array([0, 0.5, 0.5, 1.0]), 3)),
    (r"only inner breakpoints.*\(2,\)", lambda: PhaseMesh(np.array([0, 0.5, 1.0]), 3, (2,))),
    (r"'intervals' is -3; give a positive integer", lambda: Settings(intervals=-3)),
    (r"'path' is 0.0; give a positive number", lambda: Settings(accuracy=Accuracy(path=0.0))),
    (
        r"'controls' is 'cubic'; choose one of constant, linear, polynomial, automatic, full",
        lambda: Settings(controls="cubic"),
    ),
    (
        r"at least one objective",
        lambda: solve_lexicographic(minimise(moved := move(), moved.at_end(X)), []),
    ),
    (
        r"'task' does not use the constant 'mass'",
        solving(constants={Constant("mass", "kg", 1.0): 2.0}),
    ),
    (r"phase 'idle' has no state; write dynamics", lambda: Phase("idle", {}, end=1.0)),
    (
        r"data of phase 'drive' at 1 s .*remove them",
        lambda: drive().misfit(x, [0, 1], [1, math.nan]),
    ),
    (r"between 0.1 and inf needs a guess", lambda: solve(task(drive(end=Between(0.1, math.inf))))),
    (r"breakpoint 11.0 of phase 'drive' is not between", lambda: drive(breakpoints=[11.0])),
    (r"breakpoint 'noon' of phase", lambda: drive(breakpoints=["noon"])),
    (r"two phases that meet at 0\.5 s", lambda: drive(end=Between(1, 5), breakpoints=[0.5])),
    (r"scale of 'the objective' is 0", lambda: task(drive(), scale=0)),
    (r"scale of 'effort' is -1", lambda: drive().integral(u, "effort", scale=-1)),
    # guesses
    (r"give a number, a pair \(first, last\), a function", guessed(np.linspace(0, 1, 5))),
    (r"is \(0, 0.5, 1\); give a number, a pair", guessed((0, 0.5, 1))),
    (
        r"a table of 5 times and 4 values; .* two arrays of the same length",
        guessed((np.linspace(0, 2, 5), np.zeros(4))),
    ),
    (r"5 times and 10 values", guessed((np.linspace(0, 2, 5), np.zeros((5, 2))))),
    (r"1 s follows 2 s; sort the table", guessed(([0, 2, 1], [0, 1, 2]))),
    (
        r"returns shape \(3,\) for times of shape .*; return one value for each time",
        guessed(lambda times: np.zeros(3)),
    ),
    (
        r"fails on an array of times \(ValueError.*; write it with NumPy functions",
        guessed(lambda time: 0 if time < 1 else 1),
    ),
    (r"guess of 'position' in phase 'drive' is not finite at 0 s; give finite", guessed(math.nan)),
    (r"guess of 'position'.*not finite at 0 s", guessed(lambda t: np.where(t < 0.5, np.nan, 1.0))),
    (r"guess of 'position' needs.*increasing times", guessed(([0, 1, 1], [1, 2, 3]))),
    # settings, and what they hold
    (r"no keyword 'degree'; write scheme=Radau\(3\)", lambda: Settings(degree=3)),
    (r"'solver' is 'ipopt'; give Ipopt\(\)", lambda: Settings(solver="ipopt")),
    (r"'scheme' is 'gauss'; write scheme=Gauss\(\)", lambda: Settings(scheme="gauss")),
    (r"'scheme' is .*; write Gauss\(\)", lambda: Settings(scheme=Gauss)),
    (r"'scheme' is 4; give one of Radau\(\), Gauss", lambda: Settings(scheme=4)),
    (r"'solver' is .*; give Ipopt\(\)", lambda: Settings(solver=Ipopt)),
    (r"give AdaptiveMesh\(\) or FixedMesh\(\)", lambda: Settings(refinement=False)),
    (r"'intervals' is 2.5; give a positive integer", lambda: Settings(intervals=2.5)),
    (r"'refinment'; did you mean 'refinement'\?", lambda: Settings(refinment=FixedMesh())),
    (r"'turbo'; there are scheme, intervals, controls,", lambda: Settings(turbo=True)),
    (r"'seconds' is inf; give a positive number", lambda: Settings(seconds=math.inf)),
    (r"'iterations' is 0; give a positive", lambda: Settings(iterations=0)),
    (r"'seconds' is -1.0; give a positive number", lambda: Settings(seconds=-1.0)),
    (r"'dynamic'; did you mean 'dynamics'\?", lambda: Accuracy(dynamic=1e-6)),
    (r"'replay' is -1.0; give a positive", lambda: Accuracy(replay=-1.0)),
    (r"'round'; did you mean 'rounds'\?", lambda: AdaptiveMesh(round=3)),
    (r"'rounds' of an adaptive mesh is 0; give a pos", lambda: AdaptiveMesh(rounds=0)),
    (r"of a moving mesh is 0; give a pos", lambda: MovingMesh(most_intervals=0)),
    (r"of a fixed mesh is 2.5; give a pos", lambda: FixedMesh(highest_degree=2.5)),
    (r"is inf; give a whole number", lambda: Ipopt(max_iterations=math.inf)),
    (r"'gain' of a certificate is 0; give a positive", lambda: Tolerances(gain=0)),
    (r"FixedMesh has no keyword 'rounds'", lambda: FixedMesh(rounds=3)),
    (r"did you mean 'max_iterations'\?", lambda: Ipopt(max_iteration=3)),
    (
        r"IPOPT does not accept the option nonsense=1; see the list of options",
        lambda: Ipopt(options={"nonsense": 1}),
    ),
    (
        r"does not accept the option mumps_pivot_order=99",
        lambda: Ipopt(options={"mumps_pivot_order": 99}),
    ),
    (
        r"IPOPT's option 'tol' is a field; write Ipopt\(tolerance=1e-08\)",
        lambda: Ipopt(options={"tol": 1e-8}),
    ),
    (r"tolerance is 0; give a positive number", lambda: Ipopt(tolerance=0)),
    (r"1 points.*at least 2", lambda: Lobatto(1)),
    (r"0 points.*at least 1", lambda: Radau(0)),
    (r"radau has 2\.5 points.*whole number", lambda: Radau(2.5)),
    (r"trapezoid always has 2 points.*leave it out", lambda: Trapezoid(4)),
    # vectors and tables
    ("give the number of its components, such as shape=4", lambda: State("q", shape=0)),
    ("not 'linear'; how a control.*piecewise='linear'", lambda: Control("u", shape="linear")),
    ("'lower' of 'q' has 3 entries; give 2", lambda: State("q", shape=2, lower=[0, 0, 0])),
    (r"is the tuple \(0, 1\).*give a list of 2 values", lambda: with_end((0, 1))),
    ("the final value of 'q' has 3 entries; give 2", lambda: with_end([0, 1, 2])),
    ("give at least 4 increasing numbers", lambda: Interpolant("drag", [0, 1, 1, 2], [1, 2, 3, 4])),
    ("give at least 4 increasing numbers", lambda: Interpolant("drag", [0, 1], [1, 2])),
    (r"finite values of the shape \(4,\)", lambda: Interpolant("drag", [0, 1, 2, 3], [1, 2])),
    ("finite values", lambda: Interpolant("drag", [0, 1, 2, 3], [1, 2, np.nan, 4])),
    ("choose bspline or linear", lambda: Interpolant("drag", [0, 1, 2, 3], [1, 2, 3, 4], "cubic")),
]


@pytest.mark.parametrize(("words", "misuse"), MISUSES)
def test_a_misuse_is_answered_in_one_sentence(words, misuse):
    with pytest.raises(StatementError, match=words) as caught:
        misuse()
    assert "\n" not in str(caught.value)
    assert "Possible prototypes" not in str(caught.value.__cause__)


def test_what_a_solution_cannot_sample_is_said():
    problem = task(drive())
    solution = solve(problem, settings=Settings(intervals=5))
    with pytest.raises(StatementError, match=r"one number .*solution.value"):
        solution.sample(problem.minimise, [0, 1])
    with pytest.raises(
        StatementError, match=r"'position' is not a symbol of phase 'drive'.*not anot"
    ):
        solution.sample(State("position", "m"), [0, 1])
    with pytest.raises(StatementError, match=r"no phase 'ride'; give one of 'drive'"):
        solution.sample(x, [0, 1], phase="ride")
    with pytest.raises(StatementError, match=r"7.0 s lies outside the motion \(0.0 to 2.0 s\)"):
        solution.sample(x, 7.0)
    with pytest.raises(StatementError, match=r"'position' varies in time; sample it"):
        solution.value(x)
    with pytest.raises(StatementError, match=r"sample has no keyword 'time'; did you mean 'times'"):
        solution.sample(x, time=[0, 1])
    with pytest.raises(StatementError, match=r"plot has no keyword 'signals'"):
        solution.plot(signals=[x])


def test_only_solutions_are_saved(tmp_path):
    with pytest.raises(TypeError, match=r"save writes a Solution, not Problem.*solve it first"):
        save(task(drive()), tmp_path / "task")


@pytest.mark.slow
def test_an_end_out_of_reach_names_what_is_off():
    with pytest.raises(Infeasible, match=r"'position' in phase 'drive'.*ocp.relaxed"):
        solve(task(drive(final={x: 10, v: 0})))


def test_numpy_functions_of_a_signal_are_those_of_casadi():
    assert ca.is_equal(ca.SX(np.sin(x)), ca.sin(x), 2)


def test_an_empty_unit_is_that_of_a_plain_number():
    assert State("prey", "").unit == Constant("share", " ", 0.5).unit == "1"


def test_symbols_print_as_one_would_write_them():
    ceiling = Constant("ceiling", "m", 2.0)
    assert repr(State("h", "m", upper=ceiling)) == f"State(name='h', unit='m', upper={ceiling!r})"
    assert repr(Bound("room", u, upper=1)) == "Bound(name='room', expression=SX(force), upper=1)"
    assert repr(Control("f")) == "Control(name='f')"
    assert repr(Unknown("k", guess=2)) == "Unknown(name='k', guess=2)"


def test_checked_classes_can_be_copied():
    between = Between(1, 2)
    assert copy.copy(between) == pickle.loads(pickle.dumps(between)) == between
    assert copy.copy(drive()).name == "drive"


@pytest.mark.parametrize("value", [math.nan, math.inf, None, "2"])
def test_a_value_of_a_constant_that_is_no_number_is_named(value):
    mass = Constant("mass", "kg", 1.0)
    heavy = drive(dynamics={x: v, v: u / mass})
    with pytest.raises(StatementError, match=r"constant 'mass' is .*; give it a finite number"):
        solve(task(heavy), constants={mass: value})


def other_cells():
    """Phases that a notebook may be left with, of the name of another one."""
    again = {state: State(state.name, state.unit) for state in (x, v)}
    return {
        "other rates": drive(dynamics={x: v, v: 2 * u}, end=3.0),
        "other states": drive(
            dynamics={again[x]: again[v], again[v]: u},
            initial={again[x]: 0},
            final={again[x]: 1},
        ),
        "fewer states": drive(dynamics={v: u}, initial={v: 0}, final={v: 1}),
    }


@pytest.mark.parametrize("which", other_cells())
def test_a_functional_of_another_phase_of_that_name_is_refused(which):
    phase, other = drive(), other_cells()[which]
    words = r"in problem 'task' was made from another phase named 'drive'.*make it from the"
    for misused in (
        {"minimise": other.integral(u**2)},
        {"minimise": phase.integral(u**2) + other.end_time},
        {"bounds": [peak((phase, u), (other, u)) <= 3]},
        {"links": [other.at_end(u) == 0]},
    ):
        with pytest.raises(StatementError, match=words):
            task(phase, **misused)


def test_functionals_of_a_phase_serve_its_copies():
    original = drive()
    longer = dataclasses.replace(original, end=4.0, guess={x: (0, 1)})
    written_again = drive(dynamics={x: v, v: ca.SX(u)}, end=4.0)
    damped, damped_again = (drive(dynamics={x: v, v: u - ca.sin(v) * 0.1}) for _ in range(2))
    # a rest-to-rest move by d in T needs 12 d^2 / T^3
    for copied in (longer, written_again):
        found = solve(task(copied, minimise=original.integral(u**2)))
        assert found.objective == pytest.approx(12 / 4**3, rel=1e-8)
    assert task(damped, minimise=damped_again.integral(u**2)).phases == (damped,)


@pytest.mark.parametrize("expression", [0 * x, x - x, 3.0])
def test_a_bound_on_a_mere_number_is_refused(expression: object) -> None:
    sentence = r"the bound 'room' of phase 'drive' is on the number (0|3), which is constant"
    with pytest.raises(StatementError, match=sentence):
        drive(bounds=[Bound("room", expression, lower=1.0)])
    with pytest.raises(StatementError, match="the bound 'room' of problem 'task' is on the number"):
        task(PUSH, bounds=[Bound("room", expression, lower=1.0)])
    # a limit that is sought is bounded by a number
    limited = task(PUSH, bounds=[Bound("room", 3.0, lower=MOST)])
    assert [bound.symbols for bound in limited.bounds] == [(MOST,)]


def test_a_problem_knows_its_symbols():
    phase = Phase("move", {X: U, other: z + k}, initial={X: 0}, end=1.0)
    problem = minimise(phase, phase.at_end(X))
    assert {s.name for s in problem.symbols} >= {"x", "u", "z", "k", "other"}
    assert problem.unknowns == (k,)
    assert problem.algebraics[phase.name] == (z,)


def test_phases_that_follow_each_other_without_a_link_are_told():
    phases = (PUSH, REST)
    effort = PUSH.integral(u**2 + (x - 1) ** 2) + REST.integral(u**2)
    with pytest.warns(StatementWarning, match=r"'rest' begins at 1.0 s, when 'push' ends, and"):
        solve(Problem("apart", phases, minimise=effort))

    # an unknown may stand between the two
    height, pace = Unknown("height"), Unknown("pace")
    between = [
        phase_at(state) == unknown
        for phase_at in (PUSH.at_end, REST.at_start)
        for state, unknown in ((x, height), (v, pace))
    ]
    linked = solve(Problem("linked", phases, minimise=effort, links=joined(*phases)))
    by_unknowns = solve(Problem("by unknowns", phases, minimise=effort, bounds=between))
    assert by_unknowns.objective == pytest.approx(linked.objective, rel=1e-8)


ANY_TIME = Between(0.1, 1.9)


def free_pair(begins=ANY_TIME, **second):
    """Two phases of a drive, of which the first one ends at a free time."""
    stated = {"final": GOAL, "start": begins, "end": 2.0, **second}
    return Phase("push", RATES, initial=START, end=ANY_TIME), Phase("rest", RATES, **stated)


def apart(phases, **changed):
    """A problem of two phases, of each of which something depends on the states."""
    effort = sum(phase.integral(u**2 + (x - 1) ** 2) for phase in phases)
    return Problem("apart", phases, **{"minimise": effort, **changed})


def checked(problem):
    """What is checked before a solve, without one."""
    check_before_solve(problem, parameters_of(problem))


def meeting_pairs():
    """Problems of two phases that meet, with nothing between their states."""
    same = free_pair()
    return {
        "the same range": (
            apart(same),
            r"begins between 0\.1 s and 1\.9 s, when 'push' ends, and both have the state "
            r"'position'.*links=joined.* or give 'position' an initial value in 'rest' if it",
        ),
        "another guess": (apart(free_pair(begins=Between(0.1, 1.9, 1.0))), "when 'push' ends"),
        "a budget of both": (
            apart(same, bounds=[sum(phase.integral(u**2) for phase in same) <= 9]),
            "when 'push' ends",
        ),
        "an end value in a bound": (
            apart(free_pair(final={}), bounds=[same[1].at_end(x) == 1]),
            "when 'push' ends",
        ),
    }


@pytest.mark.parametrize(("problem", "words"), meeting_pairs().values(), ids=meeting_pairs())
def test_phases_that_meet_at_a_free_time_without_a_link_are_told(problem, words):
    with pytest.warns(StatementWarning, match=words):
        checked(problem)


def separate_pairs():
    """Problems of two phases that have a link, or that none needs."""
    pair, jumping, later = free_pair(), free_pair(), free_pair(begins=Between(0.1, 1.8))
    between = Unknown("between", "m")
    alike = Between(0.0, 1.9)
    side_by_side = tuple(
        Phase(name, RATES, start=alike, end=alike, final=GOAL) for name in ("calm", "windy")
    )
    return {
        "joined": apart(pair, links=joined(*pair)),
        "jumping": apart(jumping, links=joined(*jumping, jump={v: -v})),
        "by an unknown": apart(
            pair, bounds=[pair[0].at_end(x) == between, pair[1].at_start(x) == between]
        ),
        "by an expression of several": apart(pair, bounds=[pair[1].at_start(v - 2 * x) == 0]),
        "at a price": apart(
            pair,
            minimise=pair[0].integral(u**2) + (pair[1].at_start(x) - pair[0].at_end(x)) ** 2,
            bounds=[pair[1].peak(u) <= 3],
        ),
        "begins anew": apart(free_pair(initial=START)),
        "other ranges": apart(later),
        "a pause between": apart(later, links=[later[1].start_time == later[0].end_time + 0.1]),
        "side by side": apart(side_by_side),
        "side by side from one time on": apart(free_pair(begins=0.0)),
    }


@pytest.mark.parametrize("problem", separate_pairs().values(), ids=separate_pairs())
def test_phases_that_are_linked_or_separate_are_no_false_alarm(problem):
    checked(problem)
