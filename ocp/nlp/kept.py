"""IPOPT's objects, kept for the next run of the same program, and what they call as they run.

Making one takes as long as several iterations of a small program: CasADi works out sparsity
patterns and sets IPOPT up. Along a family of motions the program stays, and only numbers change.
Its callback belongs to the object. What one run looks after is an object of its own, which the
callback is given for as long as the run lasts.

The linear solver has one thread for its dense blocks. The blocks of a collocated problem are small.
On an idle machine a second thread gains nothing, and on one with other work it spins while it waits
for a processor: a solve then takes several times as long. CasADi's wheel brings an OpenBLAS of its
own, which takes all processors unless it is told.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from typing import Any
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.nlp.interrupts import Interrupts
from ocp.nlp.solver import Listener
from ocp.transcription.kernels import Program

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
        with suppress(OSError):
            return ctypes.CDLL(f"{ca.__path__[0]}/{name}")
    return None


@cache
def keep_to_one_thread() -> None:
    """Give CasADi's OpenBLAS one thread, once in a process, unless the user asks for a number.

    NumPy and SciPy have libraries of their own, whose threads stay as they are.
    """
    library = casadi_blas()
    if library is not None and not os.environ.get(ASKED):
        library.openblas_set_num_threads(1)


# what the callback is given, of CasADi's results of a solver in this order
_GIVEN = ("x", "f", "g")


class Watch(ca.Callback):
    """The callback of IPOPT objects for programs of one size.

    Parameters
    ----------
    variables, rows, constants : int
        Sizes of the program.
    """

    def __init__(self, variables: int, rows: int, constants: int) -> None:
        ca.Callback.__init__(self)
        self._sizes = {
            "x": variables,
            "f": 1,
            "g": rows,
            "lam_x": variables,
            "lam_g": rows,
            "lam_p": constants,
        }
        self._interrupts: Interrupts | None = None
        self._listener: Listener | None = None
        self._count = 0
        self._error: BaseException | None = None
        self.construct("watch", {})

    @contextmanager
    def over(self, interrupts: Interrupts, listener: Listener | None) -> Iterator[None]:
        """Watch over a run inside the block; what the listener raises is raised at its end.

        Parameters
        ----------
        interrupts : Interrupts
            Whether the user asks to stop.
        listener : callable or None
            Is told of every iteration.
        """
        self._interrupts, self._listener = interrupts, listener
        self._count, self._error = 0, None
        try:
            yield
        finally:
            # what they hold is large, and nobody's afterwards
            self._interrupts = self._listener = None
        if self._error is not None:
            raise self._error

    def get_n_in(self) -> int:
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> Any:
        return ca.Sparsity.dense(self._sizes[ca.nlpsol_out(i)], 1)

    def has_eval_buffer(self) -> bool:
        # the solver's own numbers, not wrapped in matrices: a tenth of the time
        return True

    def eval_buffer(self, arg: Sequence[memoryview | None], res: Sequence[memoryview]) -> int:
        stop = False
        try:
            number, self._count = self._count, self._count + 1
            if self._listener is not None:
                # the arrays are the solver's own, and gone afterwards
                x, objective, rows = (_numbers(each).copy() for each in arg[: len(_GIVEN)])
                stop = self._listener(number, float(objective[0]), x, rows)
            stop |= self._interrupts is not None and self._interrupts.asked
        except BaseException as error:
            # raised after the solver has ended: CasADi would take it for a failure
            self._error, stop = error, True
        np.frombuffer(res[0])[0] = float(stop)
        return 0


def _numbers(memory: memoryview | None) -> Array:
    """The solver's numbers, which are gone after the call."""
    return np.empty(0) if memory is None or memory.nbytes == 0 else np.frombuffer(memory)


@dataclass(frozen=True, eq=False, repr=False)
class KeptSolver:
    """An IPOPT object of a program.

    Attributes
    ----------
    options : dict
        That it was made with.
    watch : Watch
        Its callback.
    arguments, results : mapping of str to (n,)
        What it reads and writes, by CasADi's names, in place: matrices made of arrays and back
        would take as long as an iteration of a small program.
    evaluate : callable
        Runs it.
    statistics : callable
        Those of the last run, by name.
    """

    options: Mapping[str, Any]
    watch: Watch
    arguments: Mapping[str, Array]
    results: Mapping[str, Array]
    evaluate: Callable[[], None]
    statistics: Callable[[], Mapping[str, Any]]

    @classmethod
    def of(cls, program: Program, options: Mapping[str, Any]) -> KeptSolver:
        """A new one."""
        keep_to_one_thread()
        watch = Watch(program.variables, program.rows, program.constants)
        functions = {
            "grad_f": program.objective_gradient,
            "jac_g": program.constraint_jacobian,
            "hess_lag": program.lagrangian_hessian,
            "iteration_callback": watch,
        }
        solver = ca.nlpsol("solver", "ipopt", program.oracle, {**options, **functions})

        buffer, evaluate = solver.buffer()
        arguments = {name: np.zeros(solver.nnz_in(name)) for name in solver.name_in()}
        results = {name: np.zeros(solver.nnz_out(name)) for name in solver.name_out()}
        for number, values in enumerate(arguments.values()):
            if values.size:
                buffer.set_arg(number, values.data)
        for number, values in enumerate(results.values()):
            if values.size:
                buffer.set_res(number, values.data)
        return cls(options, watch, arguments, results, evaluate, buffer.stats)

    def run(self, **given: Array) -> dict[str, Array]:
        """Results by CasADi's names, for arguments by its names; zero where they are left out."""
        for name, values in self.arguments.items():
            values[:] = given.get(name, 0.0)
        self.evaluate()
        return {name: values.copy() for name, values in self.results.items()}


# The last ones of each program, which go with the program. IPOPT frees its factors after a run.
# There are two, as each run may be followed by a single step that has options of its own.
_MOST = 2
_KEPT: WeakKeyDictionary[Program, list[KeptSolver]] = WeakKeyDictionary()


@contextmanager
def kept_solver(program: Program, options: Mapping[str, Any]) -> Iterator[KeptSolver]:
    """Lend the IPOPT object of a program: a kept one if it has the same options, or a new one.

    Inside the block nobody else has it: a run within the run, or one in another thread, makes its
    own. It is not kept after an error.

    Parameters
    ----------
    options : mapping
        Numbers and texts, of CasADi and of IPOPT.
    """
    kept = _KEPT.setdefault(program, [])
    lent = _taken(kept, options) or KeptSolver.of(program, options)
    yield lent
    kept.append(lent)
    del kept[:-_MOST]


def _taken(kept: list[KeptSolver], options: Mapping[str, Any]) -> KeptSolver | None:
    """One with these options, which is no longer among the kept ones; None if there is none."""
    for each in tuple(kept):
        if each.options == options:
            with suppress(ValueError):  # another thread has taken it
                kept.remove(each)
                return each
    return None
