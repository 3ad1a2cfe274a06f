"""Solutions survive pickling and files, in a process that has never seen their statement."""

import pickle
import subprocess
import sys
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
from ocp.errors import StatementError

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
    first = Phase("there", rates, {x: 0, v: 0}, end=Between(0.2, 0.8), bounds=inside,
                  guess={x: lambda t: t})  # fmt: skip
    second = Phase("on", rates, final={x: reach, v: 0}, start=Between(0.2, 0.8), end=1.0)
    top = peak((first, u), (second, u), absolute=True, name="thrust")
    effort = first.integral(u**2, name="effort")
    return Problem(
        "trip", [first, second], minimise=top + 0.01 * effort, links=joined(first, second),
        bounds=[Bound("budget", effort**2 + lost, upper=400.0)],
    )  # fmt: skip


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
        "import test_ocp_store as own",
        f"found = ocp.load({str(tmp_path / 'trip.ocp')!r})",
        f"np.save({str(tmp_path / 'found.npy')!r}, own.everything(found))",
        "assert ocp.certify(found).problem == 'trip'",
    ]
    subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True, cwd=ROOT, timeout=120)
    # the same functions of the same numbers; common parts may be summed in another order
    np.testing.assert_allclose(np.load(tmp_path / "found.npy"), everything(found), rtol=1e-9,
                               atol=1e-9)  # fmt: skip


def test_a_pickled_solution_is_alive(found):
    copy = pickle.loads(pickle.dumps(found))
    assert [s.name for s in copy.problem.symbols] == [s.name for s in found.problem.symbols]
    # expressions can be written with its symbols, next to those of the original
    own = {s.name: s for s in copy.problem.symbols}
    expected = found.sample("x", TIMES) * found.sample("u", TIMES)
    np.testing.assert_allclose(copy.sample(own["x"] * own["u"], TIMES), expected, rtol=1e-12)
    assert copy.problem.phases[0].guess == {}
    assert str(certify(copy)) == str(certify(found))


def test_a_loaded_solution_starts_a_solve(found):
    copy = pickle.loads(pickle.dumps(found))
    again = solve(copy.problem, settings=Settings(refinement=FixedMesh()), guess=copy)
    assert again.objective == pytest.approx(found.objective, rel=1e-8)  # the solver's tolerance
    # a second generation
    assert pickle.loads(pickle.dumps(again)).objective == again.objective


def test_other_files_are_refused(tmp_path):
    (tmp_path / "other").write_bytes(b"text")
    with pytest.raises(ValueError, match="holds no solution"):
        load(tmp_path / "other")


def test_unknown_names_list_the_known_ones(found):
    with pytest.raises(StatementError, match="'effort'"):
        found.value("efort")
