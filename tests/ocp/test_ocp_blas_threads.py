"""A linear solver has one thread for its dense blocks, unless the user asks for more."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ocp.nlp.kept import casadi_blas

ROOT = Path(__file__).parents[2]
NUMPYS = list(Path(np.__file__).parents[1].glob("numpy.libs/libscipy_openblas64_*"))
pytestmark = pytest.mark.skipif(
    casadi_blas() is None or not NUMPYS, reason="CasADi and NumPy have no OpenBLAS of their own"
)

# Both libraries are asked themselves: in the iterations of a solve, and after it. Before it they
# get four and three threads, so that this fails on any machine.
SOLVE = """
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


@pytest.mark.parametrize(
    ("asked", "threads"), [({}, "1 1 3"), ({"OPENBLAS_NUM_THREADS": "4"}, "4 4 3")]
)
def test_a_solve_uses_one_processor_and_numpy_as_many_as_before(asked, threads):
    kept = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    done = subprocess.run(
        [sys.executable, "-c", SOLVE, str(NUMPYS[0])],
        env={**kept, **asked, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == threads.split()
