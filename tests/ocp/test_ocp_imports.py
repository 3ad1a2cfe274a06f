"""What tools read of the package, what an import and a solve load, and how many threads."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import ocp
from ocp.nlp.kept import casadi_blas

STATEMENT = """
import sys
import ocp
x, u = ocp.State("x"), ocp.Control("u")
phase = ocp.Phase("p", {x: u}, {x: 0}, {x: 1}, end=1.0)
ocp.Problem("least effort", (phase,), minimise=phase.integral(u**2))
print(*sys.modules)
"""

SOLVE = """
import sys
from ocp import Control, Phase, Problem, State, solve
x, u = State("x"), Control("u")
phase = Phase("p", {x: u}, {x: 0}, {x: 1}, end=1.0)
solution = solve(Problem("least effort", phase, minimise=phase.integral(u**2)))
solution.sample(u, solution.breakpoints)

# a control that switches: breakpoints in brackets, and intervals that are cut beside them
r, v, a = State("r"), State("v"), Control("a", lower=-1, upper=1)
rest = Phase("p", {r: v, v: a}, {r: 0, v: 0}, {r: 1, v: 0}, end=2.5)
solve(Problem("least speed", rest, minimise=rest.peak(v)))
print(*sys.modules)
"""

HEAVY = {"scipy", "matplotlib", "multiprocessing", "subprocess", "numpy.ma"}


def loaded_by(script):
    done = subprocess.run(
        (sys.executable, "-c", script), capture_output=True, text=True, check=True
    )
    return set(done.stdout.split())


def test_an_import_loads_only_what_states_a_problem():
    loaded = loaded_by(STATEMENT)
    assert {"casadi", "ocp.problem.problem"} <= loaded
    solver = {"algorithm", "settings", "verdict", "nlp.ipopt", "refinement.refine"}
    assert not loaded & (HEAVY | {f"ocp.{module}" for module in solver})
    rooms = (
        "ocp.transcription",
        "ocp.scaling",
        "ocp.optimality",
        "ocp.verification",
        "ocp.diagnostics",
        "ocp.solution",
        "ocp.analysis",
    )
    assert not [name for name in loaded if name.startswith(rooms)]


def test_a_solve_loads_nothing_that_it_does_not_need():
    loaded = loaded_by(SOLVE)
    assert {"casadi", "ocp.algorithm", "ocp.verification.verify"} <= loaded
    further = {"mesh.coarsening", "refinement.policies.moving_mesh", "solution.storage"}
    assert not loaded & (HEAVY | {f"ocp.{module}" for module in further})
    optional = "ocp.analysis.", "ocp.diagnostics."
    assert not [name for name in loaded if name.startswith(optional)]


def test_every_public_name_is_there():
    assert set(ocp.__all__) <= set(dir(ocp))
    for name in ocp.__all__:
        assert getattr(ocp, name).__class__.__name__ != "module"
    assert set(ocp._MODULES) < set(ocp.__all__)


ROOT = Path(__file__).parents[2]
NUMPYS = list(Path(np.__file__).parents[1].glob("numpy.libs/libscipy_openblas64_*"))

# Both libraries are asked themselves: in the iterations of a solve, and after it. Before it they
# get four and three threads, so that this fails on any machine.
THREADS = """
import ctypes, sys
from ocp import Control, Phase, Problem, State, solve
from ocp.nlp.kept import casadi_blas

ours = casadi_blas()
ours.openblas_set_num_threads(4)
theirs = ctypes.CDLL(sys.argv[1])
theirs.scipy_openblas_set_num_threads64_(3)

seen = set()
x, u = State("x", "m"), Control("u", "m/s")
phase = Phase("ride", {x: u}, {x: 0}, {x: 1}, end=1.0)
solve(
    Problem("ride", phase, minimise=phase.integral(u**2)),
    progress=lambda line: seen.add(ours.openblas_get_num_threads()),
)
print(*sorted(seen), ours.openblas_get_num_threads(), theirs.scipy_openblas_get_num_threads64_())
"""


@pytest.mark.skipif(
    casadi_blas() is None or not NUMPYS, reason="CasADi and NumPy have no OpenBLAS of their own"
)
@pytest.mark.parametrize(
    ("asked", "threads"), [({}, "1 1 3"), ({"OPENBLAS_NUM_THREADS": "4"}, "4 4 3")]
)
def test_a_solve_uses_one_processor_and_numpy_as_many_as_before(asked, threads):
    kept = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    done = subprocess.run(
        [sys.executable, "-c", THREADS, str(NUMPYS[0])],
        env={**kept, **asked, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == threads.split()


def stated_version():
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]


def test_the_version_is_that_of_the_project():
    assert ocp.__version__ == stated_version(), "set the environment up again: make setup"


def test_the_citation_names_the_same_version():
    (line,) = re.findall(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert line == stated_version()


def test_type_checkers_are_told_that_the_package_is_typed():
    assert (Path(ocp.__file__).parent / "py.typed").exists()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert "py.typed" in project["tool"]["setuptools"]["package-data"]["ocp"]
