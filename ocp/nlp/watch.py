"""What IPOPT calls at every iteration: whether a run goes on, and who is told about it.

The callback belongs to an IPOPT object, which may serve several runs. What one run looks after is
an object of its own, which the callback is given for as long as the run lasts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.nlp.interrupts import Interrupts
from ocp.nlp.solver import Listener
from ocp.nlp.standstill import Divergence, Standstill
from ocp.transcription.transcribe import ProgramLimits

# what the callback is given, of CasADi's results of a solver in this order
_GIVEN = ("x", "f", "g", "lam_x", "lam_g")


@dataclass(eq=False, repr=False)
class WatchedRun:
    """What one run looks after, and what became of it.

    Attributes
    ----------
    limits : ProgramLimits
        Of the program.
    interrupts : Interrupts
        Whether the user asks to stop.
    divergence : Divergence
    standstill : Standstill or None
        None where a run ends soon enough by itself.
    listener : callable or None
        Is told of every iteration.
    count : int
        Iterations seen, the start included.
    stood_still, diverged : bool
        Why it was stopped, if it was.
    error : BaseException or None
        Of what the callback called, to be raised after the solver has ended.
    """

    limits: ProgramLimits
    interrupts: Interrupts
    divergence: Divergence
    standstill: Standstill | None = None
    listener: Listener | None = None
    count: int = 0
    stood_still: bool = False
    diverged: bool = False
    error: BaseException | None = None

    def stops(
        self, x: Array, objective: float, rows: Array, on_columns: Array, on_rows: Array
    ) -> bool:
        """Take note of an iterate; whether the run ends here.

        The arrays are the solver's own, and gone afterwards.
        """
        number = self.count
        self.count += 1
        if self.listener is not None and self.listener(number, objective, x.copy(), rows.copy()):
            return True
        violation, standstill = self.limits.violation(rows), self.standstill
        arrays = x, rows, on_columns, on_rows
        if standstill and standstill.seen(number, objective, violation, *arrays):
            self.stood_still = True
            return True
        self.diverged = self.divergence.seen(violation)
        return self.diverged or self.interrupts.asked


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
        self._run: WatchedRun | None = None
        self.construct("watch", {})

    @contextmanager
    def over(self, run: WatchedRun) -> Iterator[None]:
        """Watch over a run inside the block."""
        self._run = run
        try:
            yield
        finally:
            # what it holds is large, and nobody's afterwards
            self._run = None

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
        stop, run = False, self._run
        if run is not None:
            try:
                x, objective, rows, on_columns, on_rows = map(_numbers, arg[: len(_GIVEN)])
                stop = run.stops(x, float(objective[0]), rows, on_columns, on_rows)
            except BaseException as error:
                # raised after the solver has ended: CasADi would take it for a failure
                run.error, stop = error, True
        np.frombuffer(res[0])[0] = float(stop)
        return 0


def _numbers(memory: memoryview | None) -> Array:
    """The solver's numbers, which are gone after the call."""
    return np.empty(0) if memory is None or memory.nbytes == 0 else np.frombuffer(memory)
