"""Ten infeasible or ill-posed problems, each answered in the words of its statement."""

import dataclasses

import casadi as ca
import pytest

from ocp import (
    Between,
    Bound,
    Collapsed,
    Constant,
    Control,
    Infeasible,
    InvalidNumber,
    Ipopt,
    NumericalTrouble,
    Overdetermined,
    Phase,
    Problem,
    Settings,
    State,
    StatementError,
    StatementWarning,
    Unbounded,
    Unknown,
    solve,
)


def cart():
    return State("x", "m"), State("v", "m/s"), Control("u", "m/s^2", lower=-1, upper=1)


def contradicting_boundary_values():
    x, v, u = cart()
    phase = Phase("flight", {x: v, v: u}, {x: 0, v: 0}, {x: 0.1, v: 0}, end=1.0)
    landing = Bound("landing", phase.at_end(x), "m", lower=0.2)
    return Problem("task", [phase], minimise=phase.integral(u**2), bounds=[landing])


def unreachable_target():
    x, v, u = cart()
    phase = Phase("flight", {x: v, v: u}, {x: 0, v: 0}, {x: 2}, end=1.0)
    return Problem("task", [phase], minimise=phase.integral(u**2))


def a_free_time_that_wants_to_be_zero():
    _, v, u = cart()
    phase = Phase("flight", {v: u}, {v: 0}, {v: (-1, 1)}, end=Between(0, 10, 1))
    return Problem("task", [phase], minimise=phase.end_time)


def unbounded_objective():
    x, u = State("x", "m"), Control("u", "m/s")
    phase = Phase("flight", {x: u}, {x: 0}, end=1.0)
    return Problem("task", [phase], minimise=phase.at_end(x))


def nan_at_the_guess():
    x, v, u = cart()
    phase = Phase("flight", {x: v, v: u + ca.sqrt(x - 5)}, {x: 0, v: 0}, end=1.0)
    return Problem("task", [phase], maximise=phase.at_end(x))


def missing_dynamics():
    x, v, _ = cart()
    return Phase("flight", {x: v}, {x: 0}, end=1.0)


def a_bound_crossed():
    roof, u = Constant("roof", "m", 2.0), Control("u", "m/s")
    h = State("h", "m", lower=3, upper=roof)
    phase = Phase("flight", {h: u}, end=1.0)
    return Problem("task", [phase], minimise=phase.integral(u**2))


def a_state_never_used():
    x, v, u = cart()
    fuel = State("fuel", "kg")
    phase = Phase("flight", {x: v, v: u, fuel: -(u**2)}, {x: 0, v: 0, fuel: 1}, {x: 0.1}, end=1.0)
    return Problem("task", [phase], minimise=phase.integral(u**2))


def wrong_shapes():
    x, v, u = cart()
    return Phase("flight", {x: ca.vertcat(v, u), v: u}, end=1.0)


def duplicate_names():
    x, v, u = cart()
    phase = Phase("flight", {x: v, v: u, State("x", "m"): 1}, end=1.0)
    return Problem("task", [phase], minimise=phase.integral(u**2))


TEN = {
    contradicting_boundary_values: (
        Infeasible,
        r"no motion was found.*'task'; worst: 'landing' is off by 0\.1 m; relax one.*no proof",
    ),
    unreachable_target: (
        Infeasible,
        r"'task'; worst: dynamics of 'v' in phase 'flight' at 0\.\d+ s is off by .* m/s"
        r"; 'u' is at its upper limit of 1 m/s\^2 for 100% of 'flight': relax a limit or a "
        r"prescribed value \(ocp\.relaxed\(problem\) finds.*no proof",
    ),
    a_free_time_that_wants_to_be_zero: (
        Collapsed,
        r"motion of 'task' shrinks to .*e-\d+ s: nothing.*needs time; prescribe where",
    ),
    unbounded_objective: (
        Unbounded,
        r"objective of 'task' ran away to -.*seems unbounded; bound what it depends on",
    ),
    nan_at_the_guess: (
        InvalidNumber,
        r"'task': the derivative of 'v' in phase 'flight' is NaN or infinite at 0 s "
        r"\(in sqrt\(\(x-5\)\)\), where .*x = 0 m; start from a guess where everything is finite",
    ),
    missing_dynamics: (
        StatementError,
        r"phase 'flight' uses the state 'v' but has no dynamics.*add its derivat",
    ),
    a_bound_crossed: (
        StatementError,
        r"bounds of 'h' cross at roof = 2: lower 3 is above upper 2; change one",
    ),
    a_state_never_used: (
        StatementWarning,
        r"the state 'fuel' of phase 'flight' is never used.*remove it",
    ),
    wrong_shapes: (
        StatementError,
        r"derivative of 'x' has shape 2x1; give one scalar expression an entry",
    ),
    duplicate_names: (
        StatementError,
        r"'task' has more than one signal called 'x'; rename one of them",
    ),
}
FEW = Settings(intervals=5, solver=Ipopt(max_iterations=200))


@pytest.mark.parametrize("statement", TEN, ids=lambda f: f.__name__)
def test_each_is_answered_in_the_users_words(statement):
    kind, words = TEN[statement]
    with pytest.raises(kind, match=words) as caught:
        solve(statement(), settings=FEW)
    assert len(str(caught.value)) < 400  # one sentence


def test_an_unused_state_is_carried_along_all_the_same():
    with pytest.warns(StatementWarning, match="fuel"):
        found = solve(a_state_never_used(), settings=FEW)
    # x = int (1 - t) u: u = 0.3 (1 - t), int u^2 = 0.03
    assert found.objective == pytest.approx(0.03, rel=1e-9)


def test_more_equations_than_unknowns():
    x, v = State("x", "m"), State("v", "m/s")
    phase = Phase("fall", {x: v, v: -9.81}, {x: 1, v: 0}, end=1.0)
    ends = (phase.at_end(x), phase.at_end(v), phase.at_end(x) + phase.at_end(v))
    bounds = [Bound(n, e, lower=0, upper=0) for n, e in zip("abc", ends, strict=True)]
    problem = Problem("fall", [phase], minimise=phase.at_end(v), bounds=bounds)
    # 5 intervals of degree 4: 42 unknowns, 2 of them given; 40 rows of dynamics and 3 bounds
    words = r"'fall' has 43 equations for 40 free unknowns.*more is prescribed.*take back a bound"
    with pytest.raises(Overdetermined, match=words):
        solve(problem, settings=FEW)


def test_a_fall_to_a_prescribed_point_is_overdetermined_not_unbounded():
    x, v = State("x", "m"), State("v", "m/s")
    phase = Phase("fall", {x: v, v: -9.81}, {x: 1, v: 0}, {x: 0}, end=1.0)
    with pytest.raises(Overdetermined, match=r"40 equations.*39 free.*dynamics of 'v'.* m/s"):
        solve(Problem("fall", [phase], minimise=phase.at_end(v)), settings=FEW)


REFUSED = {
    "a boundary value beyond a bound that is a constant": (
        lambda x, u: (State("h", "m", upper=Constant("roof", "m", 2.0)), {"initial": 3}),
        r"initial value 3 of 'h' in phase 'flight' lies outside its bounds \[-inf, 2\] at roof",
    ),
    "a guess of something else": (
        lambda x, u: (State("h", "m"), {"guess": x}),
        r"'flight' has a guess for 'x', which its dynamics.*take it out or use it",
    ),
    "two bounds of one name": (
        lambda x, u: (State("h", "m"), {"bounds": ("cap", "cap")}),
        r"'task' has more than one bound of one phase called 'cap'; rename",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_statements_that_contradict_themselves_are_refused(case):
    make, words = REFUSED[case]
    x, u = State("x"), Control("u", "m/s")
    h, given = make(x, u)
    options = {k: {h: v} for k, v in given.items() if k == "initial"}
    options |= {k: {v: 1.0} for k, v in given.items() if k == "guess"}
    options |= {k: [Bound(n, h, upper=1) for n in v] for k, v in given.items() if k == "bounds"}
    phase = Phase("flight", {h: u}, end=1.0, **options)
    with pytest.raises(StatementError, match=words):
        solve(Problem("task", [phase], minimise=phase.integral(u**2)), settings=FEW)


def test_an_infinite_derivative_is_traced_to_its_part():
    x, v, u = cart()
    phase = Phase("flight", {x: v, v: u + ca.sqrt(x.symbol)}, {x: 0, v: 0}, guess={x: 0}, end=1.0)
    words = (
        r"derivative of 'v' in phase 'flight' has a derivative.*at 0 s \(in .*sqrt\(x\).*x = 0 m"
    )
    with pytest.raises(InvalidNumber, match=words):
        solve(Problem("task", [phase], maximise=phase.at_end(x)), settings=FEW)


def test_the_values_of_constants_and_unknowns_are_told():
    x, u, low = State("x", "m"), Control("u"), Constant("low", "m", 3.0)
    k = Unknown("k", lower=1, upper=3)
    phase = Phase("flight", {x: u}, {x: 0}, {x: 1}, end=1.0)
    problem = Problem("task", [phase], minimise=k * ca.log(phase.at_end(x) - low))
    words = (
        r"the objective is NaN or infinite \(in log\(\(end of flight-low\)\)\), "
        r"where k = 2, 'end of flight' = 1, low = 3 m; start"
    )
    with pytest.raises(InvalidNumber, match=words):
        solve(problem, settings=FEW)


@dataclasses.dataclass(frozen=True)
class Broken(Ipopt):
    """IPOPT that says after a solve that it broke off."""

    status: str = ""

    def solve(self, *arguments):
        return dataclasses.replace(super().solve(*arguments), outcome="failed", status=self.status)


@pytest.mark.parametrize("status", ["Error_In_Step_Computation", "Internal_Error"])
def test_numerical_trouble_is_called_that(status):
    x, v, u = cart()
    phase = Phase("flight", {x: v, v: u}, {x: 0, v: 0}, {x: 0.1}, end=1.0)
    problem = Problem("task", [phase], minimise=phase.integral(u**2))
    settings = dataclasses.replace(FEW, solver=Broken(status=status))
    words = rf"numerical trouble on 'task' after \d+ iterations \('{status}'\), all constraints met"
    with pytest.raises(NumericalTrouble, match=words):
        solve(problem, settings=settings)
