"""What an import and a solve load, and that what they do not is there when asked for."""

import subprocess
import sys

import ocp

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
    solver = {
        "algorithm",
        "settings",
        "verdict",
        "nlp.ipopt",
        "refinement.refine",
        "mesh.first_mesh",
    }
    assert not loaded & (HEAVY | {f"ocp.{module}" for module in solver})
    rooms = (
        "transcription",
        "scaling",
        "optimality",
        "verification",
        "diagnostics",
        "solution",
        "analysis",
    )
    assert not [name for name in loaded if name.startswith(tuple(f"ocp.{room}" for room in rooms))]


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
