"""Optima with a kink: their slopes on either side in closed form, and a warning."""

import math

import pytest

from ocp import (
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
    certify,
    peak,
    solve,
)

SMOOTH = 1e-6  # the solver's dual tolerance
FEW = Settings(intervals=6)


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
    with pytest.warns(ActiveSetWarning, match=r"kink.*by 'a' it changes by -?1.* for a dec"):
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


def bryson_denham(roof):
    x, v, u = State("x", "m", upper=roof), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("hop", {x: v, v: u}, {x: 0, v: 1}, {x: 0, v: -1}, end=1.0)
    return solve(Problem("Bryson-Denham", [phase], minimise=phase.integral(u**2 / 2)))


def test_a_roof_that_is_just_touched_is_noted():
    # without a roof the path is t (1 - t), which touches 1/4: J = 2, and smooth in the roof
    touched = bryson_denham(0.25).one_sided_sensitivities()["x upper"]
    assert touched.is_one
    assert touched.above == pytest.approx(0.0, abs=1e-3)
    assert "whose multiplier is zero" in touched.note
    pressing = bryson_denham(1 / 9).one_sided_sensitivities()["x upper"]
    assert pressing.note == ""
    assert pressing.above == pytest.approx(-36.0, rel=1e-4)


@pytest.mark.parametrize(("brake", "intervals"), [(1.0, 20), (2.0, 21)])
def test_a_switch_on_a_breakpoint_is_no_kink(brake: float, intervals: int) -> None:
    # from rest to rest over L = 1 m with -b <= u <= a: T = sqrt(2 L (a + b) / (a b)), and the
    # switch is at b / (a + b) of T, which is a breakpoint
    most = Constant("most", "m/s^2", 1.0)
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2", lower=-brake, upper=most)
    ends = {"initial": {x: 0, v: 0}, "final": {x: 1, v: 0}}
    phase = Phase("move", {x: v, v: u}, **ends, end=Between(0.1, 10.0))
    settings = Settings(intervals=intervals, refinement=FixedMesh())
    found = solve(Problem("rest to rest", [phase], minimise=phase.duration), settings=settings)

    duration = math.sqrt(2.0 * (1.0 + brake) / brake)
    slopes = found.sensitivities()
    assert slopes["most"] == pytest.approx(duration / 2 * (1 / (1 + brake) - 1), rel=1e-6)
    assert slopes["u upper"] == pytest.approx(slopes["most"], rel=1e-9)
    assert slopes["u lower"] == pytest.approx(
        duration / 2 * (1 / brake - 1 / (1 + brake)), rel=1e-6
    )
    assert slopes["move: x final"] == pytest.approx(duration / 2, rel=1e-6)


def test_two_switches_on_breakpoints_are_no_kinks() -> None:
    # the jerk switches at T/4 and 3T/4; T = (32 L / j)^(1/3)
    most = Constant("most", "m/s^3", 4.0)
    x, v, a = State("x", "m"), State("v", "m/s"), State("a", "m/s^2")
    jerk = Control("jerk", "m/s^3", lower=-most.symbol, upper=most)
    ends = {"initial": {x: 0, v: 0, a: 0}, "final": {x: 1, v: 0, a: 0}}
    phase = Phase("move", {x: v, v: a, a: jerk}, **ends, end=Between(0.1, 10.0))
    found = solve(
        Problem("rest to rest", [phase], minimise=phase.duration),
        settings=Settings(intervals=20, refinement=FixedMesh()),
    )
    assert found.objective == pytest.approx(2.0, rel=1e-8)
    slopes = found.sensitivities()
    assert slopes["most"] == pytest.approx(-2.0 / 3 / 4.0, rel=1e-6)
    assert slopes["move: x final"] == pytest.approx(2.0 / 3, rel=1e-6)


@pytest.mark.parametrize(("brake", "intervals"), [(1.0, 20), (2.0, 21), (3.0, 8)])
def test_an_exact_answer_on_a_mesh_that_stays_is_certified(brake: float, intervals: int) -> None:
    # the same motion again; the solver may end with any multipliers that fit its mesh
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2", lower=-brake, upper=1.0)
    ends = {"initial": {x: 0, v: 0}, "final": {x: 1, v: 0}}
    phase = Phase("move", {x: v, v: u}, **ends, end=Between(0.1, 10.0))
    settings = Settings(intervals=intervals, refinement=FixedMesh())
    found = solve(Problem("rest to rest", [phase], minimise=phase.duration), settings=settings)
    assert certify(found).passed, str(certify(found))

    duration = math.sqrt(2.0 * (1.0 + brake) / brake)
    switch = duration * brake / (1.0 + brake)
    # H = 1 + p_x v + p_v u = 0 with p_v = 0 at the switch, where v = a t: p_x = -1 / v
    assert found.costate("x", 0.5 * duration) == pytest.approx(-1.0 / switch, rel=1e-6)
    assert found.costate("v", 0.0) == pytest.approx(-1.0, rel=1e-6)


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
