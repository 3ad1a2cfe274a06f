"""What a solution shows and gives away: summaries, samples, tables, files, figures."""

import csv
import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

import ocp
from ocp import (
    TIME,
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
    certify,
    joined,
    peak,
    solve,
)
from ocp.analysis.homotopy import homotopy
from tests.ocp.problems import least_effort

FEW = Settings(intervals=6)
MOST_LINES, MOST_CHARACTERS = 10, 800


def trip():
    """Two phases, the second with a signal more; an unknown, a constant, a bound, a peak."""
    drag = Constant("drag", "1/s", 0.3)
    x, v, fuel = State("x", "m"), State("v", "m/s", upper=3), State("fuel", "J")
    u = Control("u", "m/s^2", lower=-9, upper=9)
    lost = Unknown("lost", "m/s^2", lower=0.1, upper=1, guess=0.5)
    rates = {x: v, v: u - drag * v - lost}
    first = Phase("there", rates, {x: 0, v: 0}, end=Between(0.2, 0.8), bounds=[u * v <= 8])
    second = Phase(
        "on", {**rates, fuel: u**2}, {fuel: 0}, {x: 1, v: 0}, start=Between(0.2, 0.8), end=1.0
    )
    thrust = peak((first, u), (second, u), absolute=True, name="thrust", unit="m/s^2")
    return Problem(
        "trip",
        [first, second],
        minimise=thrust,
        bounds=[second.at_end(fuel) <= 90],
        links=joined(first, second),
    )


@pytest.fixture(scope="module")
def found():
    return solve(trip(), settings=FEW)


def test_a_solution_prints_its_essence_in_ten_lines(found):
    text = repr(found)
    assert len(text.splitlines()) <= MOST_LINES
    assert len(text) <= MOST_CHARACTERS
    for part in (
        "Solution of 'trip'",
        f"minimum      {found.objective:.10g} m/s^2",
        "verdict      local: best of ",  # it states no guess, and its phases meet freely
        "0 to 1 s",
        f"{len(found.mesh_iterations)} mesh iterations, {found.iterations} iterations",
        f"replayed end {found.verification.miss:.1e}",
        "lost = 0.1 m/s^2",
        "thrust = ",
    ):
        assert part in text, part
    assert "not verified" in repr(solve(least_effort(), settings=Settings(verify=False)))


def test_the_errors_shown_are_those_of_the_answer(found):
    assert found.verification.dynamics == pytest.approx(found.mesh_iterations[-1].dynamics_error)
    # the last mesh of a refinement may have failed, or be worse than the answer's
    failed = replace(found.mesh_iterations[-1], dynamics_error=math.nan)
    later = replace(found, mesh_iterations=(*found.mesh_iterations, failed))
    assert f"dynamics {found.verification.dynamics:.1e}" in str(later)


@pytest.mark.parametrize(
    ("later", "side"), [(1.0, "lower"), (-1.0, "upper"), (None, "")], ids=["soon", "late", "inside"]
)
def test_an_end_at_its_limit_is_said(later, side):
    x, u = State("x", "m"), Control("u", "m/s")
    phase = Phase("move", {x: u}, {x: 0}, {x: 1}, end=Between(0.5, 2.0))

    # the effort is 1 / end, so that with the time beside it the best end is 1 s
    cost = phase.integral(u**2) + phase.end_time if later is None else later * phase.end_time
    text = str(solve(Problem("move", phase, minimise=cost), settings=FEW))
    assert (f"the end of 'move' is at its {side} limit" in text) == bool(side)


def test_every_public_object_prints_short(found):
    path = homotopy(found.problem, found.problem.constants[0], 0.31, settings=FEW, guess=found)
    things = [
        found.problem,
        *found.problem.phases,
        *found.problem.symbols,
        *found.problem.bounds,
        found.trajectory,
        *found.trajectory.phases,
        found.trajectory.phases[0].state_polynomial,
        found.mesh,
        found.multipliers,
        *found.multipliers.costates,
        *found.multipliers.paths,
        found.iterate,
        found.iterate.transcription,
        found.iterate.scales,
        found.evaluator,
        found.replay,
        found.verification,
        *found.mesh_iterations,
        found.scaling,
        certify(found),
        FEW,
        path,
        ocp.prepare(found.problem),
        ocp.audit(found.problem, starts=1, settings=FEW),
    ]

    for thing in things:
        assert len(repr(thing).splitlines()) <= MOST_LINES, type(thing)
        assert len(repr(thing)) <= MOST_CHARACTERS, type(thing)


def test_several_signals_are_sampled_at_once(found):
    times = np.linspace(0.0, 1.0, 6).reshape(2, 3)
    signals = {s.name: s for s in found.problem.symbols}
    x, v = found.sample([signals["x"], "v"], times)
    np.testing.assert_array_equal(x, found.sample("x", times))
    np.testing.assert_array_equal(v, found.sample(signals["v"], times))
    assert found.sample(["x"], 0.5).shape == (1,)
    with pytest.raises(StatementError, match=r"1.5 s lies outside the motion \(0.0 to 1.0 s\)"):
        found.sample(["x", "v"], [0.5, 1.5])


def test_a_table_has_all_signals_and_both_sides_of_a_joint(found):
    columns = found.table()
    assert list(columns) == ["time", "phase", "x", "v", "u", "fuel"]
    assert {len(column) for column in columns.values()} == {len(columns["time"])}
    joint = found.trajectory.phases[0].end
    assert list(columns["phase"][columns["time"] == joint]) == ["there", "on"]
    # a phase without a signal has no number for it
    in_first = columns["phase"] == "there"
    assert np.isnan(columns["fuel"][in_first]).all()
    assert not np.isnan(columns["fuel"][~in_first]).any()
    for name in ("x", "u"):
        expected = found.sample(name, columns["time"][in_first], "there")
        np.testing.assert_array_equal(columns[name][in_first], expected)


def test_a_table_at_times_of_ones_own(found):
    times = [0.9, 0.1, 0.95]
    columns = found.table(times)
    np.testing.assert_array_equal(columns["time"], times)
    assert list(columns["phase"]) == ["on", "there", "on"]
    np.testing.assert_array_equal(columns["x"], found.sample("x", times))
    with pytest.raises(StatementError, match="lies outside"):
        found.table([2.0])
    assert list(solve(least_effort(), settings=FEW).table()) == ["time", "x", "v", "u"]


def test_a_csv_file_says_what_it_is_and_carries_units(found, tmp_path):
    found.to_csv(tmp_path / "trip.csv")
    lines = (tmp_path / "trip.csv").read_text().splitlines()
    remarks = [line for line in lines if line.startswith("#")]
    assert f"# objective: {found.objective!r} m/s^2" in remarks
    assert "# drag: 0.3 1/s" in remarks
    assert f"# written by: antenna-ocp {ocp.__version__}" in remarks
    rows = list(csv.DictReader(lines[len(remarks) :]))
    assert list(rows[0]) == ["time [s]", "phase", "x [m]", "v [m/s]", "u [m/s^2]", "fuel [J]"]
    x = [float(row["x [m]"]) for row in rows]
    np.testing.assert_array_equal(x, found.table()["x"])


def test_a_plot_has_a_panel_for_everything_that_varies(found):
    figure = found.plot()
    assert isinstance(figure, Figure)
    titles = [panel.get_title(loc="left") for panel in figure.axes]
    assert titles == [
        "x [m]",
        "u [m/s^2]",
        "costate of x [(m/s^2)/m]",
        "v [m/s]",
        "u*v <= 8",
        "costate of v [(m/s^2)/(m/s)]",
        "fuel [J]",
        "costate of fuel [(m/s^2)/J]",
    ]
    assert "trip: minimum" in figure.get_suptitle()


def test_a_plot_draws_the_solution_its_bounds_and_its_mesh(found):
    panel = next(p for p in found.plot().axes if p.get_title(loc="left") == "u [m/s^2]")
    curves = [line for line in panel.lines if line.get_linestyle() == "-"]
    times, values = curves[0].get_data()
    inside = ~np.isin(times, found.breakpoints)  # at breakpoints it draws both sides
    np.testing.assert_allclose(values[inside], found.sample("u", times[inside]), rtol=1e-9)
    limits = [line.get_ydata()[0] for line in panel.lines if line.get_linestyle() == "--"]
    assert limits == [-9.0, 9.0, -9.0, 9.0]
    ticks = [line.get_xdata() for line in panel.lines if line.get_marker() == "|"]
    for drawn, motion in zip(ticks, found.trajectory.phases, strict=True):
        np.testing.assert_array_equal(drawn, motion.breakpoints)


def test_matplotlib_is_loaded_when_a_plot_is_asked_for():
    code = """
import sys
from ocp import Control, Phase, Problem, State, solve
x, u = State("x"), Control("u")
phase = Phase("p", {x: u}, {x: 0}, {x: 1}, end=1.0)
solution = solve(Problem("least effort", phase, minimise=phase.integral(u**2)))
print(repr(solution), solution.table()["x"][-1])
assert "matplotlib" not in sys.modules
solution.plot()
assert "matplotlib" in sys.modules
assert "matplotlib.pyplot" not in sys.modules
"""
    subprocess.run((sys.executable, "-c", code), check=True, capture_output=True)


def test_a_statement_prints_as_a_textbook_has_it():
    x, v = State("x", "m", upper=1 / 8), State("v", "m/s")
    u = Control("u", "m/s^2", lower=-9, upper=9)
    g = Constant("g", "m/s^2", 9.81)
    phase = Phase(
        "hop",
        {x: v, v: u - g * TIME},
        {x: 0, v: (0, 1)},
        {x: 0},
        end=Between(0.5, 2, 1),
        bounds=[Bound("power", u * v, "W", upper=8), v >= -5],
    )
    effort = phase.integral(u**2 / 2, unit="m^2/s^3")
    problem = Problem("hop", phase, minimise=effort, bounds=[phase.end_time <= 1.5])

    assert str(problem) == (
        """\
Problem 'hop'
  minimise      integral of u^2/2 over hop   [m^2/s^3]
  phase 'hop'   start 0 s, end 0.5 to 2 s (free)
    dynamics    d x/dt = v
                d v/dt = u - g*time
    initial     x = 0 m
                0 <= v <= 1 m/s
    final       x = 0 m
    states      x <= 0.125 m
                v   [m/s]
    controls    -9 <= u <= 9 m/s^2
    bounds      power: u*v <= 8 W
                v >= -5 m/s
  bounds        end of hop <= 1.5 s
  constants     g = 9.81 m/s^2"""
    )
    assert repr(problem) == (
        "Problem('hop': minimise integral of u^2/2 over hop; 1 phase, 2 states, 1 control)"
    )
