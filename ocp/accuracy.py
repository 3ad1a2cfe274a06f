"""How right an answer has to be."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from numbers import Real
from typing import Any

from ocp.errors import StatementError
from ocp.keywords import as_written, checked_keywords

# Of one number for all: below the first, round-off is compared, and above the other no motion is
# resolved.
LEAST, MOST = 1e-9, 0.1

# A replay may exceed by this factor what the solve was held to: errors of the intervals add up on
# the way to its end.
SLACK = 10.0


@checked_keywords()
@dataclass(frozen=True, repr=False)
class Accuracy:
    """What refinement and verification allow, all relative.

    Parameters
    ----------
    dynamics : float
        How far the integrated residual of the dynamics goes in an interval, by the size of the
        states.
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


class OneNumberOrAll:
    """A field that holds an `Accuracy`, and takes one number for all of it.

    Raises
    ------
    StatementError
        When it is given what is no accuracy, or one that round-off does not allow.
    """

    def __get__(self, instance: Any, owner: Any = None) -> Accuracy:
        return Accuracy() if instance is None else instance.__dict__["accuracy"]

    def __set__(self, instance: Any, value: Accuracy | float) -> None:
        if not isinstance(value, Accuracy):
            _check_number(value)
            value = Accuracy(*[float(value)] * len(fields(Accuracy)))
        instance.__dict__["accuracy"] = value


ONE_NUMBER_OR_ALL = OneNumberOrAll()


def _check_number(value: Any) -> None:
    """StatementError unless one number makes sense as an accuracy."""
    number = float(value) if isinstance(value, Real) else math.nan
    if not 0 < number < MOST:
        remedy = f"a positive number below {MOST}, such as 1e-4, or Accuracy(objective=1e-4)"
    elif number < LEAST:
        remedy = f"{LEAST:g}, the least that round-off allows"
    else:
        return
    raise StatementError(f"the setting 'accuracy' is {value!r}; give {remedy}")
