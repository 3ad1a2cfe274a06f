"""How many threads a linear solver has for its dense blocks.

The blocks of a collocated problem are small. On an idle machine a second thread gains nothing, and
on one with other work it spins while it waits for a processor: a solve then takes several times as
long. CasADi's wheel brings an OpenBLAS of its own, which takes all processors unless it is told.
"""

from __future__ import annotations

import ctypes
import os
from functools import cache
from pathlib import Path

import casadi as ca

# The environment variable by which a user asks for more. OMP_NUM_THREADS does not count: it is set
# for the tasks of a parallel linear solver, each of which wants one thread.
ASKED = "OPENBLAS_NUM_THREADS"

# On Linux and on Windows, beside CasADi. On macOS and in other builds it has a library of the
# system, which other packages use as well: that stays as it is.
_NAMES = ("libcasadi-tp-openblas.so.0", "libcasadi-tp-openblas.dll")


@cache
def casadi_blas() -> ctypes.CDLL | None:
    """The OpenBLAS that CasADi's solvers alone use; None if they share one with others."""
    for name in _NAMES:
        path = Path(ca.__file__).parent / name
        if path.exists():
            return ctypes.CDLL(str(path))
    return None


@cache
def keep_to_one_thread() -> None:
    """Give CasADi's OpenBLAS one thread, once in a process, unless the user asks for a number.

    NumPy and SciPy have libraries of their own, whose threads stay as they are.
    """
    library = casadi_blas()
    if library is not None and not os.environ.get(ASKED):
        library.openblas_set_num_threads(1)
