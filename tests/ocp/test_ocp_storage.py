"""Solutions survive files, in a process that has never seen their statement, and run no code."""

import io
import json
import pickle
import subprocess
import sys
import zipfile
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

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
    Unknown,
    certify,
    joined,
    load,
    peak,
    save,
    solve,
)
from ocp.errors import FileError, StatementError
from ocp.solution.storage import packed, tabulated, unpacked

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
def found():
    return solve(two_phases(), settings=Settings(intervals=6, refinement=FixedMesh()))


NUMBERS = ["objective", "thrust", "effort", "budget", "lost", "drag", "time from there to on"]


def everything(solution):
    numbers = [solution.value(name) for name in NUMBERS]
    numbers += [solution.value("effort", replayed=True)]
    signals = [solution.sample(name, TIMES) for name in ("x", "v", "u")]
    signals += [solution.sample("power", TIMES[:2]), solution.costate("x", TIMES)]
    slopes = solution.sensitivities()
    return np.concatenate([numbers, *signals, [slopes[key] for key in sorted(slopes)]])


def test_every_named_expression_evaluates_in_a_fresh_process(found, tmp_path):
    save(found, tmp_path / "trip.ocp")
    lines = [
        "import sys; import numpy as np; import ocp",
        f"sys.path.insert(0, {str(Path(__file__).parent)!r})",
        "import test_ocp_storage as own",
        f"found = ocp.load({str(tmp_path / 'trip.ocp')!r})",
        f"np.save({str(tmp_path / 'found.npy')!r}, own.everything(found))",
        "assert ocp.certify(found).problem == 'trip'",
    ]
    subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True, cwd=ROOT, timeout=120)
    # the same functions of the same numbers; common parts may be summed in another order
    np.testing.assert_allclose(
        np.load(tmp_path / "found.npy"), everything(found), rtol=1e-9, atol=1e-9
    )


@pytest.fixture(scope="module")
def loaded(found, tmp_path_factory):
    path = tmp_path_factory.mktemp("files") / "trip.ocp"
    save(found, path)
    return load(path)


def test_a_loaded_solution_is_alive(found, loaded):
    assert [s.name for s in loaded.problem.symbols] == [s.name for s in found.problem.symbols]
    # expressions can be written with its symbols, next to those of the original
    own = {s.name: s for s in loaded.problem.symbols}
    expected = found.sample("x", TIMES) * found.sample("u", TIMES)
    np.testing.assert_allclose(loaded.sample(own["x"] * own["u"], TIMES), expected, rtol=1e-12)
    assert str(certify(loaded)) == str(certify(found))
    assert repr(loaded) == repr(found)
    assert str(loaded.problem) == str(found.problem)


def test_what_a_solution_knows_of_its_making_is_kept(found, loaded):
    assert loaded.mesh_iterations == found.mesh_iterations
    assert loaded.verification == found.verification
    assert loaded.verdict == found.verdict
    for kept, made in zip(loaded.mesh.phases, found.mesh.phases, strict=True):
        np.testing.assert_array_equal(kept.breakpoints, made.breakpoints)
    assert loaded.iterate.scheme == found.iterate.scheme
    np.testing.assert_array_equal(loaded.iterate.x, found.iterate.x)
    np.testing.assert_array_equal(loaded.iterate.row_multipliers, found.iterate.row_multipliers)
    np.testing.assert_array_equal(
        loaded.sample("x", TIMES, replayed=True), found.sample("x", TIMES, replayed=True)
    )
    assert loaded.multipliers.boundary == found.multipliers.boundary


def test_guesses_that_are_functions_become_tables(loaded):
    first, second = loaded.problem.phases
    ((signal, (times, values)),) = first.guess.items()
    assert signal.name == "x"
    np.testing.assert_array_equal(values, times)
    assert second.guess == {}


def test_a_loaded_solution_starts_a_solve(found, loaded, tmp_path):
    again = solve(loaded.problem, settings=Settings(refinement=FixedMesh()), guess=loaded)
    assert again.objective == pytest.approx(found.objective, rel=1e-8)  # the solver's tolerance
    # a second generation
    save(again, tmp_path / "again")
    assert load(tmp_path / "again").objective == again.objective


def test_what_is_known_is_left_out_and_referred_to(found):
    own = unpacked(packed(found, known=found.problem), known=found.problem)
    assert own.problem is found.problem
    assert own.iterate.problem is found.problem
    np.testing.assert_array_equal(everything(own), everything(found))
    # both sides count the objects of the problem in the same order
    copy = unpacked(packed(found.problem))
    other = unpacked(packed(found, known=found.problem), known=copy)
    assert other.problem is copy
    np.testing.assert_allclose(everything(other), everything(found), rtol=1e-9, atol=1e-9)


def test_numpy_opens_the_arrays_without_objects(found, tmp_path):
    save(found, tmp_path / "trip.ocp")
    with zipfile.ZipFile(tmp_path / "trip.ocp") as archive:
        text = json.loads(archive.read("solution.json"))
        arrays = [name for name in archive.namelist() if name != "solution.json"]
        for name in arrays:
            array = np.lib.format.read_array(io.BytesIO(archive.read(name)), allow_pickle=False)
            assert array.dtype.kind in "fi"
    assert (text["format"], text["version"]) == ("ocp solution", 7)


def test_pickling_is_answered_with_what_to_write(found):
    with pytest.raises(TypeError, match=r"write ocp\.save\(solution, path\)"):
        pickle.dumps(found)


def rewritten(found, path, change):
    """A file of a solution, some members of which are replaced by what is made of them."""
    save(found, path)
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in (members | change(members)).items():
            archive.writestr(name, data)
    return path


def changed(found, path, change):
    """A file of a solution whose text is changed."""

    def with_change(members):
        text = json.loads(members["solution.json"])
        change(text)
        return {"solution.json": json.dumps(text).encode()}

    return rewritten(found, path, with_change)


def of_class(text, name):
    return next(entry for entry in text["objects"] if entry.get("class") == name)


class Trap:
    """Would say so if it were ever unpickled."""

    def __reduce__(self):
        return pytest.fail, ("unpickled",)


def test_other_files_are_refused(found, tmp_path):
    path = tmp_path / "other"
    for data in (b"text", b"", pickle.dumps(Trap())):
        path.write_bytes(data)
        with pytest.raises(ValueError, match=r"holds no solution; give a file that ocp.save wrote"):
            load(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("letter.txt", "text")
    with pytest.raises(ValueError, match="holds no solution"):
        load(path)


def test_a_path_that_leads_nowhere_is_named(found, tmp_path):
    nowhere = tmp_path / "nowhere" / "trip.ocp"
    cannot = rf"'{nowhere}' cannot be (read|written) \(No such file or directory\); give "
    for use, *arguments in ((load,), (save, found), (found.to_csv,)):
        with pytest.raises(FileError, match=cannot):
            use(*arguments, nowhere)
    with pytest.raises(FileError, match=r"cannot be read \(Is a directory\); give the path of a"):
        load(tmp_path)


def test_files_of_other_versions_are_refused(found, tmp_path):
    (tmp_path / "first").write_bytes(b"ocp solution 1\n" + pickle.dumps(Trap()))
    with pytest.raises(ValueError, match="holds no solution"):
        load(tmp_path / "first")
    path = changed(found, tmp_path / "later", lambda text: text.update(version=8))
    with pytest.raises(ValueError, match=r"in file version 8, but .*solve again and save it"):
        load(path)


def test_truncated_files_are_refused_at_every_length(found, tmp_path):
    save(found, tmp_path / "whole")
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
        (lambda text: text.update(root={"object": 10**6}), "which is not there"),
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
def test_changed_files_are_refused(found, tmp_path, change, message):
    path = changed(found, tmp_path / "changed", change)
    with pytest.raises(ValueError, match=message) as caught:
        load(path)
    assert "solve again and save it" in str(caught.value)


def test_python_objects_among_the_arrays_are_not_read(found, tmp_path):
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.array([Trap()], dtype=object), allow_pickle=True)
    path = rewritten(found, tmp_path / "trap", lambda _: {"0.npy": stream.getvalue()})
    with pytest.raises(ValueError, match=r"damaged.*Object arrays cannot be loaded"):
        load(path)


def test_unknown_names_list_the_known_ones(found):
    with pytest.raises(StatementError, match="'effort'"):
        found.value("efort")


def test_a_problem_with_tables_takes_the_same_steps_here_and_where_it_is_read():
    problem = tabulated(two_phases())
    read = unpacked(packed(problem))
    here, there = (solve(each, settings=Settings(intervals=5)) for each in (problem, read))
    assert (here.objective, here.iterations) == (there.objective, there.iterations)
