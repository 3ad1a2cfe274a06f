"""What a solve loads, and that what it does not is there when asked for."""

import subprocess
import sys

import ocp

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


def test_a_solve_loads_nothing_that_it_does_not_need():
    done = subprocess.run((sys.executable, "-c", SOLVE), capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert {"casadi", "ocp.solve", "ocp.verification.verify"} <= loaded
    later = {f"ocp.{module}" for module in ocp._LATER}
    unused = {"scipy", "matplotlib", "multiprocessing", "subprocess", "numpy.ma"}
    assert not loaded & (unused | later)


def test_every_public_name_is_there():
    assert set(ocp.__all__) <= set(dir(ocp))
    for name in ocp.__all__:
        assert getattr(ocp, name).__class__.__name__ != "module"
    assert set(ocp._MODULES) < set(ocp.__all__)
