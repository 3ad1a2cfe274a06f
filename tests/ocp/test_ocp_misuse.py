"""A mistake of a newcomer is answered in one sentence with thing, value and remedy."""

import copy
import dataclasses
import math
import pickle

import casadi as ca
import numpy as np
import pytest

from ocp import (
    Algebraic,
    Between,
    Bound,
    Constant,
    Control,
    Infeasible,
    Phase,
    Problem,
    Settings,
    State,
    StatementError,
    Unknown,
    audit,
    certify,
    homotopy,
    joined,
    peak,
    save,
    scaling_report,
    solve,
    with_objective,
)

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


def guessed(guess):
    """A solve from a guess of the position."""
    return lambda: solve(task(drive(guess={x: guess})))


WRONG_KEYWORDS = {
    "State, near": (lambda: State("h", uper=1), r"State .* 'uper'; did you mean 'upper'"),
    "State, another tool's": (lambda: State("h", min=2), r"State .* 'min'; write lower=2$"),
    "State, a start": (
        lambda: State("h", initial=2),
        r"State .* 'initial'; .*Phase\(initial=\{state: 2\}\)",
    ),
    "Control": (
        lambda: Control("f", piecwise="linear"),
        r"Control .* 'piecwise'; did you mean 'piecewise'",
    ),
    "Algebraic": (lambda: Algebraic("z", ub=3), r"Algebraic .* 'ub'; write upper=3$"),
    "Unknown": (lambda: Unknown("k", initial=3), r"Unknown .* 'initial'; write guess=3$"),
    "Constant": (lambda: Constant("k", val=3), r"Constant .* 'val'; write value=3$"),
    "Between": (lambda: Between(1, 2, initial=1.5), r"Between .* 'initial'; write guess=1.5$"),
    "Bound": (lambda: Bound("room", x, max=3), r"Bound .* 'max'; write upper=3$"),
    "Phase, near": (
        lambda: Phase("p", dynamic=RATES, end=1.0),
        r"Phase .* did you mean 'dynamics'",
    ),
    "Phase, no end": (
        lambda: Phase("p", dynamics=RATES),
        r"Phase has no 'end'; write Phase\(name, dynamics, end=...\); initial, final",
    ),
    "Phase, a duration": (
        lambda: drive(duration=3),
        r"Phase .* 'duration'; write end=3, or end=Between\(lower, upper\)",
    ),
    "Phase, constraints": (
        lambda: drive(constraints=[]),
        r"Phase .* 'constraints'; write bounds=\[...\]",
    ),
    "Problem, near": (lambda: Problem("p", drive(), minimize=0), r"did you mean 'minimise'"),
    "Problem, a cost": (lambda: Problem("p", drive(), cost=0), r"'cost'; write minimise="),
    "Settings": (lambda: Settings(interval=3), r"Settings .* did you mean 'intervals'"),
    "Settings, another tool's": (lambda: Settings(tol=1e-6), r"'tol'; write accuracy="),
    "solve, another tool's": (
        lambda: solve(task(drive()), verbose=True),
        r"solve .* 'verbose'; write progress=True",
    ),
    "solve, a setting": (
        lambda: solve(task(drive()), intervals=30),
        r"solve .* 'intervals'; .*settings=Settings\(...\)",
    ),
    "solve": (lambda: solve(task(drive()), setting=0), r"solve .* did you mean 'settings'"),
    "integral": (lambda: drive().integral(u, units="N"), r"integral .* did you mean 'unit'"),
    "peak": (lambda: peak((drive(), u), absolut=True), r"peak .* did you mean 'absolute'"),
    "peak of a phase": (lambda: drive().peak(u, absolut=True), r"did you mean 'absolute'"),
    "misfit": (lambda: drive().misfit(x, [0], [1], weight=2), r"did you mean 'weights'"),
}

MISSING = {
    "a name": (
        lambda: Phase(dynamics=RATES, end=1.0),
        r"Phase has no 'name'; write Phase\(name, dynamics",
    ),
    "the phases": (lambda: Problem(drive(), minimise=0), r"Problem has no 'phases'; write Problem"),
    "an expression": (lambda: Bound("room", upper=1), r"Bound has no 'expression'"),
}

WRONG_KINDS = {
    "a phase to solve": (
        lambda: solve(drive()),
        r"'drive' is a phase without an objective; write Problem\('drive', phase, minimise",
    ),
    "phases to solve": (lambda: solve([drive()]), r"is of type list; give a Problem\(name, phases"),
    "a phase to report": (lambda: scaling_report(drive()), r"'drive' is a phase without"),
    "a phase to change": (lambda: with_objective(drive(), 0), r"'drive' is a phase without"),
    "a problem to certify": (lambda: certify(task(drive())), r"a Solution, not .*solve it first"),
    "a phase joined to itself": (lambda: joined(PUSH, PUSH), r"'push' with itself; give the phase"),
    "a jump by name": (
        lambda: joined(PUSH, REST, jump={"speed": v / 2}),
        r"into phase 'rest' is of 'speed', which is no state of it; give a State itself",
    ),
    "a jump of another state": (
        lambda: joined(PUSH, REST, jump={State("height"): v / 2}),
        r"is of 'height', which is no state of it; give .* one of position, speed",
    ),
    "phases that cannot meet": (
        lambda: joined(PUSH, Phase("late", RATES, start=2.5, end=3.0)),
        r"'late' cannot begin where phase 'push' ends: the one starts at 2.5 s, the other ends at",
    ),
    "a limit called as a bound": (
        lambda: drive(dynamics={x: v, v: PUSHED}, bounds=[Bound("pushed upper", v, upper=9)]),
        r"becomes the bound 'pushed upper' of phase 'drive', but there is another .* rename it",
    ),
    "a limit that nothing in the phase has": (
        lambda: priced(drive(), PUSHED),
        r"the limit of 'pushed' depends on an unknown, but phase 'drive' has 'pushed' in an int",
    ),
    "a value of a stranger": (
        lambda: solve(task(drive())).value(MOST),
        r"the problem has no Unknown 'most'; there are: none",
    ),
    "a homotopy in a stranger": (
        lambda: homotopy(task(drive()), Constant("load", value=1), 2),
        r"'task' does not use the constant 'load'; there are: none",
    ),
    "starts by a word": (lambda: audit(task(drive()), starts="all"), r"'all'; give a whole number"),
    "a bound by a word": (
        lambda: solve(task(drive()), bound="low"),
        r"'bound' is 'low'; give a finite nu",
    ),
    "a name to join": (lambda: joined(drive(), "next"), r"one is 'next'; write joined\(first"),
    "a text as phase": (lambda: Problem("p", "drive", minimise=0), r"phase of .* is 'drive'; give"),
    "a list of derivatives": (
        lambda: drive(dynamics=[v, u]),
        r"'dynamics' of phase 'drive' is \[.*dynamics=\{state: expression\}",
    ),
    "a list of end values": (lambda: drive(final=[1, 0]), r"'final' of phase .* is \[1, 0\]; give"),
    "a text as end value": (lambda: drive(final={x: "1"}), r"'final position' is '1'; give a num"),
    "a list as range": (lambda: drive(final={x: [1, 2]}), r"is \[1, 2\]; give a number or a pair"),
    "a name with an end value": (
        lambda: drive(final={"position": 1}),
        r"a final value for 'position' .*give the State itself",
    ),
    "a control with an end value": (
        lambda: drive(final={u: 1}),
        r"a final value for 'force' .*phase.at_end\(force\)",
    ),
    "a name with a guess": (
        lambda: solve(task(drive(guess={"position": 1}))),
        r"a guess for 'position'.*give the signal itself",
    ),
    "a number as unit": (lambda: State("h", 0, 1), r"unit of 'h' is 0; give a text .*lower="),
    "a pair as bound": (lambda: State("h", upper=(0, 1)), r"bound of 'h' is \(0, 1\); give a num"),
    "None as bound": (lambda: State("h", upper=None), r"bound of 'h' is None; .* leave it out"),
    "a text as guess": (lambda: Unknown("k", guess="1"), r"guess of 'k' is '1'; give a finite"),
    "a text as scale": (lambda: State("h", scale="1"), r"scale of 'h' is '1'; give a positive"),
    "a text as objective": (
        lambda: task(drive(), minimise="time"),
        r"objective is 'time', not a CasADi SX expression; give one expression of signals",
    ),
    "a method as objective": (
        lambda: task(drive(), minimise=drive().integral),
        r"objective is <bound .*; call it",
    ),
    "a signal as objective": (
        lambda: task(drive(), minimise=v),
        r"uses the signal 'speed' as if it were a number; wrap it in at_start",
    ),
    "a relation as objective": (
        lambda: task(drive(), minimise=drive().integral(u) <= 3),
        r"objective .* is the relation .*; minimise one number, and give relations as bounds",
    ),
    "a peak of a phase and a signal": (
        lambda: peak(drive(), u),
        r"a piece of the peak 'peak' is Phase.*; write phase.peak\(expression\)",
    ),
    "an integral of a peak": (
        lambda: drive().integral(drive().peak(u, name="load")),
        r"the integral is taken of 'load', which is a number of the whole motion",
    ),
    "an instant behind its expression": (
        lambda: drive().at(x, 1.0),
        r"an instant of phase 'drive' is State\(.*; write phase.at\(instant, expression\)",
    ),
    "dynamics before the name": (
        lambda: Phase(RATES, "drive", end=1.0),
        r"name of a phase is \{.*give a text",
    ),
    "a number as a problem's name": (
        lambda: Problem(1, drive(), minimise=0),
        r"name of a problem is 1; give a text",
    ),
    "an expression before its name": (
        lambda: Bound(x, "room", upper=1),
        r"name of a bound is State\(.*give a text",
    ),
    "a limit as a bound's unit": (
        lambda: Bound("room", x, 0, 1),
        r"unit of 'room' is 0; give a text .*lower=",
    ),
    "a text as guess of a time": (lambda: Between(1, 2, "1.5"), r"guess '1.5' of a free time"),
    "a number as jump": (lambda: joined(drive(), drive(), jump=3), r"'jump' .* is 3; give a dict"),
    "a list of constants": (
        lambda: solve(task(drive()), constants=[3]),
        r"'constants' is \[3\]; give a dictionary",
    ),
    "an MX": (lambda: drive().integral(ca.MX.sym("k")), r"an MX does not mix .* of type SX"),
}

SYMBOLS_AS_NUMBERS = {
    "if": (lambda: 1 if x > 0 else 2, r"'0<position' is neither true .*ca.if_else.* of if$"),
    "max": (lambda: max(x, v), r"neither true nor false"),
    "np.where": (lambda: np.where(x > 0, 1, 2), r"ca.if_else\(.*\) instead of np.where$"),
    "math.sin": (lambda: math.sin(x), r"'position' is a symbol and no number; write ca.sin"),
    "float": (lambda: float(Unknown("k")), r"'k' is a symbol .*solution.value"),
}

GUESSES = {
    "an array": (np.linspace(0, 1, 5), r"give a number, a pair \(first, last\), a function"),
    "a triple": ((0, 0.5, 1), r"is \(0, 0.5, 1\); give a number, a pair"),
    "fewer values than times": (
        (np.linspace(0, 2, 5), np.zeros(4)),
        r"a table of 5 times and 4 values; .* two arrays of the same length",
    ),
    "a column too many": ((np.linspace(0, 2, 5), np.zeros((5, 2))), r"5 times and 10 values"),
    "times out of order": (([0, 2, 1], [0, 1, 2]), r"1 s follows 2 s; sort the table"),
    "a function of another length": (
        lambda times: np.zeros(3),
        r"returns shape \(3,\) for times of shape .*; return one value for each time",
    ),
    "a function of one time only": (
        lambda time: 0 if time < 1 else 1,
        r"fails on an array of times \(ValueError.*; write it with NumPy functions",
    ),
}

MISUSES = {**WRONG_KEYWORDS, **MISSING, **WRONG_KINDS, **SYMBOLS_AS_NUMBERS} | {
    f"guess: {what}": (guessed(guess), words) for what, (guess, words) in GUESSES.items()
}


@pytest.mark.parametrize("case", MISUSES)
def test_a_misuse_is_answered_in_one_sentence(case):
    misuse, words = MISUSES[case]
    with pytest.raises(StatementError, match=words) as caught:
        misuse()
    assert "\n" not in str(caught.value)
    assert "Possible prototypes" not in str(caught.value.__cause__)


def test_what_a_solution_cannot_sample_is_said():
    problem = task(drive())
    solution = solve(problem, settings=Settings(intervals=5))
    with pytest.raises(StatementError, match=r"one number .*solution.value"):
        solution.sample(problem.minimise, [0, 1])
    with pytest.raises(StatementError, match=r"'position' is no symbol of phase 'drive'.*not anot"):
        solution.sample(State("position", "m"), [0, 1])
    with pytest.raises(StatementError, match=r"no phase 'ride'; give one of 'drive'"):
        solution.sample(x, [0, 1], phase="ride")
    with pytest.raises(StatementError, match=r"sample has no keyword 'time'; did you mean 'times'"):
        solution.sample(x, time=[0, 1])
    with pytest.raises(StatementError, match=r"plot has no keyword 'signals'"):
        solution.plot(signals=[x])


def test_data_without_a_value_are_refused():
    with pytest.raises(StatementError, match=r"data of phase 'drive' at 1 s .*take them out"):
        drive().misfit(x, [0, 1], [1, math.nan])


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


def test_a_limit_of_a_time_is_a_number():
    with pytest.raises(StatementError, match=r"limit of a free time is Unknown.*Bound\('end'"):
        Between(0.1, MOST)


@pytest.mark.parametrize("bound", [math.nan, -math.inf, "4"])
def test_a_bound_of_the_optimum_is_a_finite_number(bound):
    with pytest.raises(StatementError, match=r"argument 'bound' is .*; give a finite number"):
        solve(task(drive()), bound=bound)


def test_a_phase_has_a_state():
    with pytest.raises(StatementError, match=r"phase 'idle' has no state; write dynamics"):
        Phase("idle", {}, end=1.0)


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
    words = r"in problem 'task' was made from another phase of the name 'drive'.*make it from the"
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
    sentence = r"the bound 'room' of phase 'drive' is on the number (0|3), which no motion changes"
    with pytest.raises(StatementError, match=sentence):
        drive(bounds=[Bound("room", expression, lower=1.0)])
    with pytest.raises(StatementError, match="the bound 'room' of problem 'task' is on the number"):
        task(PUSH, bounds=[Bound("room", expression, lower=1.0)])
    # a limit that is sought is bounded by a number
    limited = task(PUSH, bounds=[Bound("room", 3.0, lower=MOST)])
    assert [bound.symbols for bound in limited.bounds] == [(MOST,)]
