"""Sensitivities, also those of a kink, against closed forms and differences of solved problems."""

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest
from scipy.sparse import csr_matrix

from ocp import (
    TIME,
    Accuracy,
    ActiveSetWarning,
    Between,
    Bound,
    Constant,
    Control,
    FixedMesh,
    Phase,
    Problem,
    Settings,
    State,
    Unknown,
    certify,
    joined,
    peak,
    solve,
)
from ocp.analysis.multiplier_sets import MultiplierChanges
from ocp.analysis.sensitivity import slopes_by_multipliers
from ocp.mesh.mesh import uniform, with_points
from ocp.optimality.multipliers import all_multipliers
from tests.ocp.problems import (
    bryson_denham,
    double_integrator,
    moved_by_jerk,
    rest_to_rest,
    solved_on,
)

# closed forms: meshes are refined until finer controls gain less than 1e-5 of the optimum
CLOSE = 1e-4
SMOOTH = 1e-6  # the solver's dual tolerance
FEW = Settings(intervals=6)


# slopes to 1e-4 need the ends of the arc on the cap closer than the default tolerance asks
TIGHT = Settings(accuracy=Accuracy(path=1e-8))


def test_bryson_denham():
    # J = 4 / (9 l), whatever the duration; the position costate jumps by -18 twice
    found = solve(bryson_denham(), settings=TIGHT)
    slopes = found.sensitivities()
    assert slopes["x upper"] == pytest.approx(-36.0, rel=CLOSE)
    assert slopes["hop: v initial"] == pytest.approx(6.0, rel=CLOSE)
    assert slopes["hop: end"] == pytest.approx(0.0, abs=36 * CLOSE)
    costate = found.costate("x", [0.1, 0.5, 0.9])
    np.testing.assert_allclose(costate, [18, 0, -18], atol=18 * CLOSE)


def test_slopes_by_the_solvers_own_multipliers():
    # J = 4 / (9 l), the ceiling stated as a constant, once with either sign
    ceiling = Constant("ceiling", "m", 1 / 9)
    x, v = State("x", "m", lower=-2 * ceiling.symbol, upper=ceiling), State("v", "m/s")
    u = Control("u", "m/s^2")
    phase = Phase("hop", {x: v, v: u}, initial={x: 0, v: 1}, final={x: 0, v: -1}, end=1.0)
    for sense in (1, -1):
        effort = phase.integral(u**2 / 2)
        aim = {"minimise": effort} if sense > 0 else {"maximise": -effort}
        found = solve(Problem("ceiling", [phase], **aim), settings=TIGHT)
        slope = slopes_by_multipliers(found)["ceiling"]
        assert slope == pytest.approx(-36.0 * sense, rel=CLOSE)
        assert slope == pytest.approx(found.sensitivities()["ceiling"], rel=1e-9)


@pytest.mark.parametrize("shape", ["constant", "polynomial"])
def test_least_time(shape):
    # T^2 = 2 D (a + b) / (a b): dT/dD = T / (2 D), dT/da = -T b / (2 a (a + b))
    a, b, d = Constant("a", value=1.0), Constant("b", value=2.0), Constant("D", value=300.0)
    *_, phase = rest_to_rest(d, Between(1, 100), lower=-b, upper=a, piecewise=shape)
    slopes = solve(Problem("least time", [phase], minimise=phase.end_time)).sensitivities()
    expected = {
        "D": 0.05,
        "a": -10.0,
        "b": -2.5,
        "u upper": -10.0,
        "u lower": 2.5,
        "move: x final": 0.05,
        "move: x initial": -0.05,
        "move: start": 1.0,
    }
    for name, value in expected.items():
        assert slopes[name] == pytest.approx(value, rel=CLOSE), name


def test_least_peak_of_acceleration_under_a_jerk_limit():
    # D = A (T/2 - A/j) T/2 with T = 2: dA/dD = 1 / (1 - 2 A/j), dA/dj = -(A/j)^2 dA/dD
    slopes = solve(lift(distance=Constant("D", "m", 1.0))).sensitivities()
    peak = 4 * (1 - math.sqrt(0.5))
    by_distance = 1 / (1 - peak / 4)
    assert slopes["D"] == pytest.approx(by_distance, rel=CLOSE)
    assert slopes["j"] == pytest.approx(-((peak / 8) ** 2) * by_distance, rel=CLOSE)
    # time scales as 1/T: A(D, j, T) T^2 is a function of D and j T^3 alone
    by_time = (-2 * peak + 3 * 8 * (peak / 8) ** 2 * -by_distance) / 2
    assert slopes["move: end"] == pytest.approx(by_time, rel=CLOSE)


def swing(gravity=9.0, torque=4.0, effort=14.0, end=2.0, angle=0.1, sense="minimise"):
    """A pendulum lifted with bounded effort, a guessed damper and a limited speed."""
    g, top = Constant("g", value=gravity), Constant("torque", value=torque)
    q, w = State("q", upper=2.6), State("w")
    u = Control("u", lower=-top, upper=top)
    damper = Unknown("damper", lower=0.1, upper=1.0, guess=0.2)
    phase = Phase(
        "swing",
        {q: w, w: u - g * ca.sin(q) - damper * w},
        {q: angle, w: 0},
        {w: (-1, 1)},
        end=end,
        bounds=[Bound("speed", w * (1 + 0.1 * q), upper=2.0)],
    )
    gain = phase.at_end(q) - 0.05 * damper
    limit = Bound("effort", phase.integral(u**2), upper=effort)
    goal = {"minimise": -gain} if sense == "minimise" else {"maximise": gain}
    return Problem("swing", [phase], bounds=[limit], **goal)


def slide(gravity=9.8, depth=2.0, start=0.0):
    """The fastest slide, which meets a sloping floor."""
    g = Constant("g", value=gravity)
    x, y, v = State("x"), State("y"), State("v", lower=0)
    slope = Control("slope", lower=-1, upper=3)
    phase = Phase(
        "slide",
        {x: v * ca.sin(slope), y: v * ca.cos(slope), v: g * ca.cos(slope)},
        {x: 0, y: 0, v: 0},
        {x: 3, y: depth},
        start=start,
        end=Between(0.1, 5, 1),
        bounds=[Bound("floor", y - 0.2 * x, upper=1.5)],
        guess={slope: (0.1, 1.5), v: (0, 5)},
    )
    return Problem("slide", [phase], minimise=phase.end_time)


def lift(jerk=8.0, distance=1.0):
    """Least peak of acceleration under a limited jerk."""
    cap = Constant("j", "m/s^3", jerk)
    a, _, phase = moved_by_jerk(distance, 2.0, lower=-cap, upper=cap, piecewise="constant")
    return Problem("lift", [phase], minimise=phase.peak(a, absolute=True))


def throw(loss=0.8, floor=0.5, there=1.0):
    """Up to a wall, back from it with a part of the speed, and never below a speed limit."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2", lower=-9, upper=9)
    kept = Constant("kept", value=loss)
    out = Phase("out", {x: v, v: u - 0.1 * v**2}, {x: 0, v: 0}, {x: there}, end=Between(0.2, 3, 1))
    pace = Bound("pace", -v, "m/s", lower=floor)
    back = Phase(
        "back",
        {x: v, v: u - 0.1 * v**2},
        {},
        {x: 0.2},
        start=Between(0.2, 3, 1),
        end=Between(0.5, 5, 2),
        bounds=[pace],
    )
    links = joined(out, back, jump={v: -kept * v})
    effort = 0.1 * (out.integral(u**2) + back.integral(u**2))
    return Problem("throw", [out, back], minimise=back.end_time + effort, links=links)


FROZEN = Settings(intervals=12, refinement=FixedMesh())


@pytest.mark.parametrize(
    ("statement", "argument", "name", "value"),
    [
        (swing, "gravity", "g", 9.0),
        (swing, "torque", "torque", 4.0),
        (swing, "effort", "effort upper", 14.0),
        (swing, "end", "swing: end", 2.0),
        (swing, "angle", "swing: q initial", 0.1),
        (slide, "gravity", "g", 9.8),
        (slide, "depth", "slide: y final", 2.0),
        (slide, "start", "slide: start", 0.0),
        (bryson_denham, "roof", "x upper", 1 / 9),
        (bryson_denham, "speed", "hop: v initial", 1.0),
        (lift, "jerk", "j", 8.0),
        (lift, "distance", "move: x final", 1.0),
        (throw, "loss", "kept", 0.8),
        (throw, "floor", "back: pace lower", 0.5),
        (throw, "there", "out: x final", 1.0),
    ],
)
def test_central_differences_on_a_frozen_mesh(statement, argument, name, value):
    found = solve(statement(), settings=FROZEN)
    step = 1e-4 * max(value, 0.1)  # differences: error of the second order, 1e-7
    ends = [
        solve(statement(**{argument: value + s}), settings=FROZEN, guess=found).objective
        for s in (step, -step)
    ]
    slope = (ends[0] - ends[1]) / (2 * step)
    # the optimum is solved to 1e-9 and differenced over 1e-4: 1e-5
    assert found.sensitivities()[name] == pytest.approx(slope, rel=1e-4, abs=1e-6)


def changes_of(equations):
    """Multipliers of which every change that fits some equations is allowed."""
    count = equations.shape[1]
    reach = np.full(count, 10.0)
    return MultiplierChanges(np.arange(count), csr_matrix(equations), -reach, reach, many=True)


def test_what_the_equations_add_up_to_is_the_same_for_all_multipliers(monkeypatch):
    # two equations, one of them twice, and one that is hardly one
    equations = np.array([[1.0, 1.0, 0.0, 0.0], [2.0, 2.0, 0.0, 0.0], [0.0, 0.0, 1e-7, 0.0]])
    changes = changes_of(equations)
    assert not changes.is_combination(np.array([1.0, 0.0, 0.0, 0.0]))
    assert not changes.is_combination(np.array([0.0, 0.0, 0.0, 1.0]))

    # without a linear program: 3 (z1 + z2) + 2 z3
    monkeypatch.setattr(MultiplierChanges, "most", None)
    assert changes.range_of(np.array([3.0, 3.0, 2.0, 0.0])) == (0.0, 0.0)


def test_a_range_that_no_linear_program_finds_is_said(monkeypatch):
    found = solve(bryson_denham(), settings=TIGHT)
    everything = changes_of(np.zeros((1, all_multipliers(found.kept_iterate).size)))
    monkeypatch.setattr(MultiplierChanges, "of", lambda *arguments: everything)
    monkeypatch.setattr(MultiplierChanges, "most", lambda self, direction: math.nan)
    slope = found.one_sided_sensitivities()["x upper"]
    assert slope.is_one
    assert slope.below == pytest.approx(-36.0, rel=CLOSE)
    assert "the range of the slope was not found" in slope.note
    with pytest.warns(ActiveSetWarning, match="'x upper'.* was not found"):
        assert found.sensitivities()["x upper"] == pytest.approx(-36.0, rel=CLOSE)


def test_a_maximum_has_the_sign_of_the_user():
    low = solve(swing(), settings=FROZEN)
    high = solve(swing(sense="maximise"), settings=FROZEN)
    assert high.objective == pytest.approx(-low.objective, rel=1e-8)  # the same program
    pairs = (low.sensitivities(), high.sensitivities())
    assert pairs[0].keys() == pairs[1].keys()
    for name, slope in pairs[0].items():
        assert pairs[1][name] == pytest.approx(-slope, abs=1e-5), name  # solver's dual tolerance


def test_multipliers_of_problem_bounds_have_the_name_and_sign_of_their_limit():
    found = solve(swing(), settings=FROZEN)
    effort = found.multipliers.boundary["effort"]
    assert effort > 0
    assert found.sensitivities()["effort upper"] == pytest.approx(-effort, rel=1e-12)
    (speed,) = [p for p in found.multipliers.paths if p.name == "speed"]
    # complementarity to the barrier's 1e-8 and less
    assert speed.masses.min() >= -1e-6
    assert -found.sensitivities()["swing: speed upper"] == pytest.approx(
        speed.masses.sum(), abs=1e-6
    )


def test_slopes_of_two_free_times_with_a_longest_duration():
    """The cheapest two seconds are around 7 s: J = 1 / (2 atan(L / 2)), dJ/dL = -J^2 / 2."""
    x, u, longest = State("x"), Control("u"), Constant("longest", "s", 2.0)
    times = {"start": Between(1, 20, 6), "end": Between(3.5, 25, 8)}
    move = Phase("move", {x: u}, {x: 0}, {x: 1}, **times)
    price = 1 + (TIME - 7) ** 2
    bound = Bound("duration", move.duration, upper=longest)
    found = solve(Problem("cheap", move, minimise=move.integral(price * u**2), bounds=[bound]))
    best = 1 / (2 * math.atan(1.0))
    assert found.objective == pytest.approx(best, rel=1e-7)
    slopes = found.sensitivities()
    assert slopes["longest"] == pytest.approx(-(best**2) / 2, rel=CLOSE)
    assert slopes["move: x final"] == pytest.approx(2 * best, rel=CLOSE)


def test_beyond_an_end_value_at_its_limit_there_is_no_motion():
    most, start = Constant("most", "m", 1.0), Constant("start", "m", 1.0)
    x, v, u = State("x", "m", upper=most), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("down", {x: v, v: u}, {x: start, v: 0}, {x: 0, v: 0}, end=1.0)
    solution = solve(Problem("down", phase, minimise=phase.integral(u**2)))
    sided = solution.one_sided_sensitivities()
    # 12 (start)^2 is least; the limit cannot fall, and the start cannot rise
    for name in ("most", "x upper"):
        assert sided[name].below == -math.inf
        assert sided[name].above == pytest.approx(0.0, abs=1e-5)
    for name in ("start", "down: x initial"):
        assert sided[name].below == pytest.approx(24.0, rel=1e-6)
        assert sided[name].above == math.inf
    assert "infeasible" in sided["most"].note
    slopes = solution.sensitivities()
    assert slopes["start"] == pytest.approx(24.0, rel=1e-6)
    assert slopes["most"] == pytest.approx(0.0, abs=1e-5)


def two_caps(first=1.0, second=1.0, sense="maximise"):
    """x(1) is the smaller of two caps of x': it falls with either, and rises with none."""
    a, b = Constant("a", value=first), Constant("b", value=second)
    x, u = State("x"), Control("u", upper=a)
    phase = Phase("dash", {x: u}, {x: 0}, bounds=[Bound("cap", u, upper=b)], end=1.0)
    end = phase.at_end(x)
    return Problem("dash", [phase], **{sense: end if sense == "maximise" else -end})


@pytest.mark.parametrize(("sense", "sign"), [("maximise", 1.0), ("minimise", -1.0)])
def test_two_caps_at_once(sense, sign):
    found = solve(two_caps(sense=sense), settings=FEW)
    slopes = found.one_sided_sensitivities()
    for name in ("a", "b", "u upper", "dash: cap upper"):
        assert slopes[name].below == pytest.approx(sign, abs=SMOOTH), name
        assert slopes[name].above == pytest.approx(0.0, abs=SMOOTH), name
        assert "about to change" in slopes[name].note
    assert slopes["dash: end"].is_one
    assert slopes["dash: end"].above == pytest.approx(sign, abs=SMOOTH)
    with pytest.warns(
        ActiveSetWarning, match=r"kink.*with respect to 'a' its slope is -?1.* for a dec"
    ):
        plain = found.sensitivities()
    assert math.isnan(plain["a"])
    assert plain["dash: x initial"] == pytest.approx(sign, abs=SMOOTH)


def test_caps_that_are_apart_have_one_slope_each():
    slopes = solve(two_caps(second=1.01), settings=FEW).one_sided_sensitivities()
    assert all(s.is_one for s in slopes.values())
    assert slopes["a"].above == pytest.approx(1.0, abs=SMOOTH)
    assert slopes["b"].above == pytest.approx(0.0, abs=SMOOTH)


def test_the_larger_of_two_peaks():
    # least peak of a u and b u with a mean u of 1 is max(a, b): at a = b only an increase counts
    a, b = Constant("a", value=1.0), Constant("b", value=1.0)
    x, u = State("x"), Control("u", piecewise="constant")
    phase = Phase("move", {x: u}, {x: 0}, {x: 1}, end=1.0)
    top = peak((phase, a * u), (phase, b * u), name="load")
    slopes = solve(Problem("move", [phase], minimise=top), settings=FEW).one_sided_sensitivities()
    for name in ("a", "b"):
        assert slopes[name].below == pytest.approx(0.0, abs=SMOOTH)
        assert slopes[name].above == pytest.approx(1.0, abs=SMOOTH)
    assert slopes["move: x final"].is_one
    assert slopes["move: x final"].above == pytest.approx(1.0, abs=SMOOTH)


def test_a_roof_that_is_just_touched_is_noted():
    # without a roof the path is t (1 - t), which touches 1/4: J = 2, and smooth in the roof
    touched = solve(bryson_denham(0.25)).one_sided_sensitivities()["x upper"]
    assert touched.is_one
    assert touched.above == pytest.approx(0.0, abs=1e-3)
    assert "its multiplier is zero" in touched.note
    pressing = solve(bryson_denham()).one_sided_sensitivities()["x upper"]
    assert pressing.note == ""
    assert pressing.above == pytest.approx(-36.0, rel=1e-4)


@pytest.mark.parametrize(("brake", "intervals"), [(0.5, 21), (2.0, 21), (3.0, 8)])
def test_a_switch_on_a_breakpoint_is_no_kink(brake: float, intervals: int) -> None:
    # from rest to rest over L = 1 m with -b <= u <= a: T = sqrt(2 L (a + b) / (a b)), and the
    # switch is at b / (a + b) of T, which is a breakpoint; the solver may end with any multipliers
    # that fit its mesh
    most = Constant("most", "m/s^2", 1.0)
    *_, phase = rest_to_rest(end=Between(0.1, 10.0), lower=-brake, upper=most)
    found = solved_on(intervals, Problem("rest to rest", [phase], minimise=phase.duration))
    assert certify(found).passed, str(certify(found))

    duration = math.sqrt(2.0 * (1.0 + brake) / brake)
    switch = duration * brake / (1.0 + brake)
    # H = 1 + p_x v + p_v u = 0 with p_v = 0 at the switch, where v = a t: p_x = -1 / v
    assert found.costate("x", 0.5 * duration) == pytest.approx(-1.0 / switch, rel=1e-6)
    assert found.costate("v", 0.0) == pytest.approx(-1.0, rel=1e-6)

    slopes = found.sensitivities()
    assert slopes["most"] == pytest.approx(duration / 2 * (1 / (1 + brake) - 1), rel=1e-6)
    assert slopes["u upper"] == pytest.approx(slopes["most"], rel=1e-9)
    assert slopes["u lower"] == pytest.approx(
        duration / 2 * (1 / brake - 1 / (1 + brake)), rel=1e-6
    )
    assert slopes["move: x final"] == pytest.approx(duration / 2, rel=1e-6)


@pytest.mark.parametrize("intervals", [8, 10, 40])
def test_a_switch_on_the_middle_breakpoint_has_the_slope_of_repeated_solves(intervals: int) -> None:
    # the solver may end there with the multipliers of the problem, and others fit as well
    def fastest(most: float, far: float = 1.0) -> Problem:
        *_, phase = rest_to_rest(far, Between(0.1, 10.0), lower=-1, upper=most)
        return Problem("rest to rest", [phase], minimise=phase.duration)

    def change(name: str) -> float:
        more, less = (solve(fastest(**({"most": 1.0} | {name: at}))) for at in (1.01, 0.99))
        return (more.objective - less.objective) / 0.02

    # central differences of T = (2 L (a + b) / (a b))^(1/2), whose third derivatives are below 2
    slopes = solved_on(intervals, fastest(1.0)).sensitivities()
    assert slopes["u upper"] == pytest.approx(change("most"), abs=1e-4)
    assert slopes["move: x final"] == pytest.approx(change("far"), abs=1e-4)


def test_two_switches_on_breakpoints_are_no_kinks() -> None:
    # the jerk switches at T/4 and 3T/4; T = (32 L / j)^(1/3)
    most = Constant("most", "m/s^3", 4.0)
    _, _, phase = moved_by_jerk(end=Between(0.1, 10.0), lower=-most.symbol, upper=most)
    found = solved_on(20, Problem("rest to rest", [phase], minimise=phase.duration))
    assert found.objective == pytest.approx(2.0, rel=1e-8)
    slopes = found.sensitivities()
    assert slopes["most"] == pytest.approx(-2.0 / 3 / 4.0, rel=1e-6)
    assert slopes["move: x final"] == pytest.approx(2.0 / 3, rel=1e-6)


def of_nothing(kind: str) -> Problem:
    """What costs nothing to move by `a`, which is zero, and its modulus or positive part else."""
    a, x = Constant("a", value=0.0), State("x")
    u, up, down = Control("u"), Control("up", lower=0), Control("down", lower=0)
    rate = up - down if kind == "parts" else u
    phase = Phase("go", {x: rate}, {x: 0}, {} if kind == "reach" else {x: a}, end=2.0)
    match kind:
        case "parts":
            return Problem(kind, phase, minimise=phase.integral(up + down))
        case "peak":
            return Problem(kind, phase, minimise=2 * phase.peak(u, absolute=True))
        case _:
            reached = Bound("reached", phase.at_end(x) - a, lower=0)
            cost = 2 * phase.peak(u, absolute=True)
            return Problem(kind, phase, minimise=cost, bounds=[reached])


@pytest.mark.parametrize(("kind", "below"), [("parts", -1.0), ("peak", -1.0), ("reach", 0.0)])
def test_where_nothing_is_left_of_the_objective_its_two_slopes_are_told(kind, below):
    found = solve(of_nothing(kind), settings=FEW)
    assert found.objective == pytest.approx(0.0, abs=1e-8)
    slopes = found.one_sided_sensitivities()["a"]
    assert slopes.below == pytest.approx(below, abs=SMOOTH)
    assert slopes.above == pytest.approx(1.0, abs=SMOOTH)


FIXED = Settings(refinement=FixedMesh())


def gust(at, width):
    """Its integral is 1."""
    return ca.exp(-(((TIME - at) / width) ** 2)) / (width * math.sqrt(math.pi))


# without a gust u = 6 - 12 t, and an impulse at t changes the effort by -u(t)
AT = 0.4321
SLOPE = -(6 - 12 * AT)


def test_a_fixed_mesh_with_breakpoints_there_knows_the_slope():
    strength = Constant("strength", "m/s", value=0.0)
    around = tuple(AT + 1e-3 * np.linspace(-4, 4, 9))
    x, v, u, _ = double_integrator()
    rates, ends = {x: v, v: u + strength * gust(AT, 1e-3)}, ({x: 0, v: 0}, {x: 1, v: 0})
    phase = Phase("move", rates, *ends, end=1.0, breakpoints=around)
    found = solve(Problem("move", phase, minimise=phase.integral(u**2 / 2)), settings=FIXED)
    assert found.sensitivities()["strength"] == pytest.approx(SLOPE, rel=1e-4)


@pytest.mark.parametrize("settings", [Settings(), FIXED])
def test_what_constants_do_everywhere_is_known_on_any_mesh(settings):
    mass, drag = Constant("mass", "kg", value=1.0), Constant("drag", "1/s", value=0.0)
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "N")
    rate = u / mass - drag * ca.sqrt(1 + v**2) + drag * ca.sin(6 * TIME)
    phase = Phase("move", {x: v, v: rate}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0)
    found = solve(Problem("m", phase, minimise=phase.integral(u**2 / 2)), settings=settings)
    slopes = found.sensitivities()
    assert slopes["mass"] == pytest.approx(12.0, rel=1e-6)
    # int u (sqrt(1 + v^2) - sin 6 t), with u = 6 - 12 t and v = 6 t - 6 t^2
    t = np.linspace(0, 1, 100_001)
    own = (6 - 12 * t) * (np.sqrt(1 + (6 * t - 6 * t**2) ** 2) - np.sin(6 * t))
    assert slopes["drag"] == pytest.approx(np.trapezoid(own, t), rel=1e-5)


def test_a_limit_that_does_not_act_there_gives_no_slope():
    wider = Constant("wider", "m/s^2", value=0.0)
    late = wider * ca.exp(-(((TIME - 0.5123) / 1e-3) ** 2))
    _, _, u, phase = rest_to_rest()
    phase = dataclasses.replace(phase, bounds=[Bound("lid", u - late, upper=5.0)])
    found = solve(Problem("move", phase, minimise=phase.integral(u**2 / 2)), settings=FIXED)
    assert found.sensitivities()["wider"] == pytest.approx(0.0, abs=1e-8)


def test_breakpoints_that_are_added_do_not_coincide():
    mesh = with_points(uniform(4, 3), np.array([0.3, 0.3 + 1e-16, 0.3 + 3e-17, 0.6]))
    assert np.allclose(mesh.breakpoints, [0, 0.25, 0.3, 0.5, 0.6, 0.75, 1])
    assert np.diff(mesh.breakpoints).min() > 1e-3
