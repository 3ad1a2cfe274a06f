"""How right an answer has to be."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from ocp.errors import StatementError
from ocp.keywords import as_written, checked_keywords


@checked_keywords()
@dataclass(frozen=True, repr=False)
class Accuracy:
    """What refinement and verification allow, all relative.

    Parameters
    ----------
    dynamics : float
        Integrated residual of the dynamics in an interval, by the size of the states.
    path : float
        Excess of peaks, path constraints and bounds between the points, by their sizes.
    objective : float
        Change of the optimum in the last refinement of the controls.
    replay : float
        Miss of the replayed end state, by the size of the states.

    Raises
    ------
    StatementError
        For a tolerance that is no positive number.
    """

    dynamics: float = 1e-7
    path: float = 1e-7
    objective: float = 1e-6
    replay: float = 1e-6

    def __repr__(self) -> str:
        return as_written(self)

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            if not (isinstance(value, (int, float)) and math.isfinite(value) and value > 0):
                raise StatementError(
                    f"the accuracy of '{entry.name}' is {value!r}; give a positive number"
                )
