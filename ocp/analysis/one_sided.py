"""Sensitivities on either side of a kink, where the active set is about to change.

The optimum as a function of a named number `p` has one-sided derivatives

    dJ/dp+ = max dL/dp,   dJ/dp- = min dL/dp   over all multipliers that fit the optimum

(Gauvin and Tolle, "Differential stability in nonlinear programming", SIAM J. Control Optim. 15,
1977, for a single minimiser).  Multipliers fit if the Lagrangian is stationary, their signs are
right and they belong to limits that are touched: a linear program, whose feasible set is a single
point at ordinary optima.  Where two limits change places its two ends differ.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.analysis.sensitivity import Slope, all_multipliers, distances, slopes
from ocp.optimality.multipliers import SolvedProgram

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

Array = NDArray[np.float64]
_SPREAD = 1e-3  # of a slope or of the objective per size, beyond which its ends count as two
_TOUCHING = 1e-6  # scaled distance from a limit below which its multiplier may change
_IDLE = 1e-4  # sum of scaled multipliers, below which a touched limit does not press
_KINK = "several limits hold the optimum at once: the active set is about to change"
_REACH = 1e3  # largest change of a multiplier, in sizes of the largest one, that is looked at


class ActiveSetWarning(UserWarning):
    """A sensitivity is not one number: it differs on the two sides."""


@dataclass(frozen=True)
class Sided:
    """Change of the optimum per unit of a named number, for a decrease and for an increase.

    Attributes
    ----------
    below, above : equal where the optimum is smooth; infinite where it has no finite slope.
    note : "" or why the value holds for small changes only.
    """

    below: float
    above: float
    note: str = ""

    @property
    def is_one(self) -> bool:
        """Whether both sides agree."""
        return self.below == self.above


def one_sided(solved: SolvedProgram, constants: Mapping[str, float]) -> dict[str, Sided]:
    """Sensitivities for a decrease and for an increase of every named number.

    Names are those of `ocp.analysis.sensitivity`, values are ``dJ/dvalue`` with `J` as it is
    minimised or
    maximised.
    """
    both = all_multipliers(solved, constants)
    other = _Multipliers.of(solved, constants, both)
    sense = solved.problem.sense
    found = {}
    for slope in slopes(solved, constants):
        value = slope.direct + float(slope.by_multiplier @ both)
        down, up = other.range_of(slope) if other.many else (0.0, 0.0)
        if up - down <= _SPREAD * max(abs(value), abs(up), abs(down), _largest(slope, both)):
            note = ""
            if slope.touching and np.abs(both[slope.by_multiplier != 0]).sum() <= _IDLE:
                note = "the limit is touched but does not press: the active set is about to change"
            found[slope.name] = Sided(sense * value, sense * value, note)
            continue
        ends = sense * (value + down), sense * (value + up)
        found[slope.name] = Sided(*ends, _KINK)
    return found


def _largest(slope: Slope, both: Array) -> float:
    """Largest single share of a slope, against which round-off is measured."""
    return float(np.abs(slope.by_multiplier * both).max(initial=0.0))


def single(found: Mapping[str, Sided]) -> dict[str, float]:
    """One number for each name, nan with a warning where the two sides differ."""
    kinks = [
        f"by '{name}' it changes by {s.below:.6g} for a decrease and {s.above:.6g} for an increase"
        for name, s in found.items() if not s.is_one
    ]  # fmt: skip
    if kinks:
        warnings.warn(
            f"the optimum has a kink, where the active set is about to change: {'; '.join(kinks)}; "
            "see one_sided_sensitivities()", ActiveSetWarning, stacklevel=3,
        )  # fmt: skip
    return {name: s.below if s.is_one else float("nan") for name, s in found.items()}


@dataclass(frozen=True, eq=False)
class _Multipliers:
    """All sets of multipliers that fit: changes `z` with ``equations @ z = 0`` and bounds.

    Attributes
    ----------
    entries : the rows, then unknowns, whose multipliers may change.
    low, high : (m,) of the changes.
    many : whether there is a change but zero.
    """

    entries: NDArray[np.int64]
    equations: csr_matrix
    low: Array
    high: Array
    many: bool

    @classmethod
    def of(cls, solved: SolvedProgram, constants: Mapping[str, float], both: Array) -> _Multipliers:
        """The multipliers around those of a solution."""
        from scipy.sparse import csr_matrix, hstack, identity  # slow to load, seldom needed

        made = solved.transcription
        values = ca.DM([constants[c.name] for c in solved.problem.constants] or ca.DM(0, 1))
        jacobian = made.program.constraint_jacobian(solved.x, values)[1].sparse()
        room = distances(solved, constants)
        entries = np.flatnonzero((room[0] <= _TOUCHING) | (room[1] <= _TOUCHING))
        equation = (room[0] + room[1])[entries] <= 0.0
        reach = _REACH * max(1.0, float(np.abs(both).max()))
        own = both[entries]
        at_lower, at_upper = (r[entries] <= _TOUCHING for r in room)
        low = np.where(equation | at_lower, -reach, np.minimum(-own, 0.0))
        high = np.where(equation | at_upper, reach, np.maximum(-own, 0.0))
        everything = hstack([csr_matrix(jacobian).T, identity(solved.x.size)]).tocsc()
        chosen = csr_matrix(everything[:, entries])
        found = cls(entries, chosen, low, high, False)
        random = np.random.default_rng(0).normal(size=entries.size)
        box = cls(entries, chosen, np.maximum(low, -1.0), np.minimum(high, 1.0), False)
        # unless zero is the only change, one of two opposite random directions finds another
        many = max(box.most(random), box.most(-random)) > _SPREAD
        return cls(found.entries, found.equations, found.low, found.high, many)

    def most(self, direction: Array) -> float:
        """Largest value of ``direction @ z``."""
        size = float(np.abs(direction).max(initial=0.0))
        if size == 0.0:
            return 0.0
        from scipy.optimize import linprog

        done = linprog(
            -direction / size, A_eq=self.equations, b_eq=np.zeros(self.equations.shape[0]),
            bounds=np.column_stack([self.low, self.high]), method="highs",
        )  # fmt: skip
        return float(-done.fun * size) if done.status == 0 else float("inf")

    def range_of(self, slope: Slope) -> tuple[float, float]:
        """Smallest and largest change of a slope; infinite at the edge of what is looked at."""
        direction = slope.by_multiplier[self.entries]
        edge = 1e-2 * _REACH * float(np.abs(direction).max(initial=0.0))
        down, up = -self.most(-direction), self.most(direction)
        return (-np.inf if down < -edge else down), (np.inf if up > edge else up)
