"""What a solution shows and gives away: summaries, samples, tables, figures, files."""

import csv
import io
import json
import math
import pickle
import subprocess
import sys
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path

import casadi as ca
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
    FixedMesh,
    Phase,
    Problem,
    Settings,
    State,
    StatementError,
    Unknown,
    certify,
    joined,
    load,
    peak,
    save,
    solve,
)
from ocp.analysis.homotopy import homotopy
from ocp.errors import FileError
from ocp.later import later, lazy_fields, read_later
from ocp.solution.storage import packed, tabulated, unpacked
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


ROOT = Path(__file__).parents[2]
TIMES = np.linspace(0.0, 1.0, 7)


def two_phases():
    """Everything that has a name: signals, an unknown, constants, bounds, functionals, a link."""
    drag, reach = Constant("drag", "1/s", 0.3), Constant("reach", "m", 1.0)
    x, v = State("x", "m"), State("v", "m/s", upper=3 * reach)
    u = Control("u", "m/s^2", lower=-9, upper=9)
    lost = Unknown("lost", "m/s^2", lower=0.1, upper=1, guess=0.5)
    rates = {x: v, v: u - drag * v - lost * ca.sin(TIME)}
    inside = [Bound("power", u * v, "W", upper=8.0)]
    first = Phase(
        "there", rates, {x: 0, v: 0}, end=Between(0.2, 0.8), bounds=inside, guess={x: lambda t: t}
    )
    second = Phase("on", rates, final={x: reach, v: 0}, start=Between(0.1, 0.9), end=1.0)
    top = peak((first, u), (second, u), absolute=True, name="thrust")
    effort = first.integral(u**2, name="effort")
    return Problem(
        "trip",
        [first, second],
        minimise=top + 0.01 * effort,
        links=joined(first, second),
        bounds=[Bound("budget", effort**2 + lost, upper=400.0)],
    )


@pytest.fixture(scope="module")
def stored():
    return solve(two_phases(), settings=Settings(intervals=6, refinement=FixedMesh()))


NUMBERS = ["objective", "thrust", "effort", "budget", "lost", "drag", "time from there to on"]


def everything(solution):
    numbers = [solution.value(name) for name in NUMBERS]
    numbers += [solution.value("effort", replayed=True)]
    signals = [solution.sample(name, TIMES) for name in ("x", "v", "u")]
    signals += [solution.sample("power", TIMES[:2]), solution.costate("x", TIMES)]
    slopes = solution.sensitivities()
    return np.concatenate([numbers, *signals, [slopes[key] for key in sorted(slopes)]])


def test_every_named_expression_evaluates_in_a_fresh_process(stored, tmp_path):
    save(stored, tmp_path / "trip.ocp")
    lines = [
        "import sys; import numpy as np; import ocp",
        f"sys.path.insert(0, {str(Path(__file__).parent)!r})",
        "import test_ocp_solution as own",
        f"stored = ocp.load({str(tmp_path / 'trip.ocp')!r})",
        f"np.save({str(tmp_path / 'stored.npy')!r}, own.everything(stored))",
        "assert ocp.certify(stored).problem == 'trip'",
    ]
    subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True, cwd=ROOT, timeout=120)
    # the same functions of the same numbers; common parts may be summed in another order
    np.testing.assert_allclose(
        np.load(tmp_path / "stored.npy"), everything(stored), rtol=1e-9, atol=1e-9
    )


@pytest.fixture(scope="module")
def loaded(stored, tmp_path_factory):
    path = tmp_path_factory.mktemp("files") / "trip.ocp"
    save(stored, path)
    return load(path)


def test_a_loaded_solution_is_alive(stored, loaded):
    assert [s.name for s in loaded.problem.symbols] == [s.name for s in stored.problem.symbols]
    # expressions can be written with its symbols, next to those of the original
    own = {s.name: s for s in loaded.problem.symbols}
    expected = stored.sample("x", TIMES) * stored.sample("u", TIMES)
    np.testing.assert_allclose(loaded.sample(own["x"] * own["u"], TIMES), expected, rtol=1e-12)
    assert str(certify(loaded)) == str(certify(stored))
    assert repr(loaded) == repr(stored)
    assert str(loaded.problem) == str(stored.problem)


def test_what_a_solution_knows_of_its_making_is_kept(stored, loaded):
    assert loaded.mesh_iterations == stored.mesh_iterations
    assert loaded.verification == stored.verification
    assert loaded.verdict == stored.verdict
    for kept, made in zip(loaded.mesh.phases, stored.mesh.phases, strict=True):
        np.testing.assert_array_equal(kept.breakpoints, made.breakpoints)
    assert loaded.iterate.scheme == stored.iterate.scheme
    np.testing.assert_array_equal(loaded.iterate.x, stored.iterate.x)
    np.testing.assert_array_equal(loaded.iterate.row_multipliers, stored.iterate.row_multipliers)
    np.testing.assert_array_equal(
        loaded.sample("x", TIMES, replayed=True), stored.sample("x", TIMES, replayed=True)
    )
    assert loaded.multipliers.boundary == stored.multipliers.boundary


def test_guesses_that_are_functions_become_tables(loaded):
    first, second = loaded.problem.phases
    ((signal, (times, values)),) = first.guess.items()
    assert signal.name == "x"
    np.testing.assert_array_equal(values, times)
    assert second.guess == {}


def test_a_loaded_solution_starts_a_solve(stored, loaded, tmp_path):
    again = solve(loaded.problem, settings=Settings(refinement=FixedMesh()), guess=loaded)
    assert again.objective == pytest.approx(stored.objective, rel=1e-8)  # the solver's tolerance
    # a second generation
    save(again, tmp_path / "again")
    assert load(tmp_path / "again").objective == again.objective


def test_what_is_known_is_left_out_and_referred_to(stored):
    own = unpacked(packed(stored, known=stored.problem), known=stored.problem)
    assert own.problem is stored.problem
    assert own.iterate.problem is stored.problem
    np.testing.assert_array_equal(everything(own), everything(stored))
    # both sides count the objects of the problem in the same order
    copy = unpacked(packed(stored.problem))
    other = unpacked(packed(stored, known=stored.problem), known=copy)
    assert other.problem is copy
    np.testing.assert_allclose(everything(other), everything(stored), rtol=1e-9, atol=1e-9)


def test_numpy_opens_the_arrays_without_objects(stored, tmp_path):
    save(stored, tmp_path / "trip.ocp")
    with zipfile.ZipFile(tmp_path / "trip.ocp") as archive:
        text = json.loads(archive.read("solution.json"))
        arrays = [name for name in archive.namelist() if name != "solution.json"]
        for name in arrays:
            array = np.lib.format.read_array(io.BytesIO(archive.read(name)), allow_pickle=False)
            assert array.dtype.kind in "fi"
    assert (text["format"], text["version"]) == ("ocp solution", 8)


def test_pickling_is_answered_with_what_to_write(stored):
    with pytest.raises(TypeError, match=r"write ocp\.save\(solution, path\)"):
        pickle.dumps(stored)


def rewritten(stored, path, change):
    """A file of a solution, some members of which are replaced by what is made of them."""
    save(stored, path)
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in (members | change(members)).items():
            archive.writestr(name, data)
    return path


def changed(stored, path, change):
    """A file of a solution whose text is changed."""

    def with_change(members):
        text = json.loads(members["solution.json"])
        change(text)
        return {"solution.json": json.dumps(text).encode()}

    return rewritten(stored, path, with_change)


def of_class(text, name):
    return next(entry for entry in text["objects"] if entry.get("class") == name)


class Trap:
    """Would say so if it were ever unpickled."""

    def __reduce__(self):
        return pytest.fail, ("unpickled",)


def test_other_files_are_refused(stored, tmp_path):
    path = tmp_path / "other"
    for data in (b"text", b"", pickle.dumps(Trap())):
        path.write_bytes(data)
        with pytest.raises(
            ValueError, match=r"contains no solution; give a file that ocp.save wrote"
        ):
            load(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("letter.txt", "text")
    with pytest.raises(ValueError, match="contains no solution"):
        load(path)


def test_a_path_that_leads_nowhere_is_named(stored, tmp_path):
    nowhere = tmp_path / "nowhere" / "trip.ocp"
    cannot = rf"'{nowhere}' cannot be (read|written) \(No such file or directory\); give "
    for use, *arguments in ((load,), (save, stored), (stored.to_csv,)):
        with pytest.raises(FileError, match=cannot):
            use(*arguments, nowhere)
    with pytest.raises(FileError, match=r"cannot be read \(Is a directory\); give the path of a"):
        load(tmp_path)


def test_files_of_other_versions_are_refused(stored, tmp_path):
    (tmp_path / "first").write_bytes(b"ocp solution 1\n" + pickle.dumps(Trap()))
    with pytest.raises(ValueError, match="contains no solution"):
        load(tmp_path / "first")
    path = changed(stored, tmp_path / "later", lambda text: text.update(version=9))
    with pytest.raises(ValueError, match=r"in file version 9, but .*solve again and save it"):
        load(path)


def test_truncated_files_are_refused_at_every_length(stored, tmp_path):
    save(stored, tmp_path / "whole")
    data = (tmp_path / "whole").read_bytes()
    for length in np.linspace(100, len(data) - 1, 40).astype(int):
        (tmp_path / "part").write_bytes(data[:length])
        with pytest.raises(ValueError, match=r"is a damaged solution .*; solve again and save it"):
            load(tmp_path / "part")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: of_class(text, "State").update({"class": "Popen"}), "unknown class 'Popen'"),
        (lambda text: of_class(text, "State")["fields"].update(shell=True), "other fields"),
        (lambda text: of_class(text, "Problem")["fields"].pop("name"), "damaged"),
        (lambda text: text.update(root={"object": 10**6}), "which does not exist"),
        (lambda text: text["objects"].insert(0, {"array": 10**6}), "damaged"),
        (lambda text: text.pop("objects"), "damaged"),
        (
            lambda text: next(e for e in text["objects"] if "instructions" in e).update(
                instructions=[["system", 0]]
            ),
            "unknown operation 'system'",
        ),
    ],
)
def test_changed_files_are_refused(stored, tmp_path, change, message):
    path = changed(stored, tmp_path / "changed", change)
    with pytest.raises(ValueError, match=message) as caught:
        load(path)
    assert "solve again and save it" in str(caught.value)


def test_python_objects_among_the_arrays_are_not_read(stored, tmp_path):
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.array([Trap()], dtype=object), allow_pickle=True)
    path = rewritten(stored, tmp_path / "trap", lambda _: {"0.npy": stream.getvalue()})
    with pytest.raises(ValueError, match=r"damaged.*Object arrays cannot be loaded"):
        load(path)


def test_unknown_names_list_the_known_ones(stored):
    with pytest.raises(StatementError, match="'effort'"):
        stored.value("efort")


def test_a_problem_with_tables_takes_the_same_steps_here_and_where_it_is_read():
    problem = tabulated(two_phases())
    read = unpacked(packed(problem))
    here, there = (solve(each, settings=Settings(intervals=5)) for each in (problem, read))
    assert (here.objective, here.iterations) == (there.objective, there.iterations)


@lazy_fields("total")
@dataclass(frozen=True)
class Bill:
    items: tuple[int, ...]
    total: int


def test_a_field_is_worked_out_once_when_it_is_first_read() -> None:
    asked = []
    bill = Bill((1, 2), later(lambda: asked.append(1) or 3))
    doubled = read_later(bill, "total", lambda total: 2 * total)
    copies = Bill((), doubled), Bill((1, 2), 3)
    assert not asked
    assert copies[0].total == 6
    assert bill.total == bill.total == 3
    assert asked == [1]
    assert bill == copies[1] == replace(bill)
    assert read_later(bill, "total", lambda total: 2 * total) == 6
