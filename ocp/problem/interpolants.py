"""Tables of measured values as functions in a statement, which files can keep."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.errors import StatementError
from ocp.keywords import checked_keywords

InterpolantKind = Literal["bspline", "linear"]

# A CasADi expression holds the function of a table only, by which the table is found again. It
# takes as little memory as the function, and lives as long as the process.
_INTERPOLANTS: dict[int, Interpolant] = {}


@checked_keywords()
@dataclass(frozen=True, eq=False, repr=False)
class Interpolant:
    """A function that interpolates values on a grid: ``drag = Interpolant("drag", speeds, drags)``.

    Call it with as many scalar expressions as the grid has axes, such as ``drag(v)``.  Outside of
    its grid it extrapolates.

    Parameters
    ----------
    name : str
        For messages and printed equations.
    points : (m,) or sequence of (m_1,), ..., (m_k,)
        Increasing points of the axis, or of each of k axes.
    values : (m,) or (m_1, ..., m_k)
        Values on the grid.
    kind : str
        "bspline" is smooth (cubic).  "linear" has a kink at each point.

    Raises
    ------
    StatementError
        If the points of an axis do not increase, there are too few of them, or the values are not
        finite or not as many as the grid has points.
    """

    name: str
    points: Any
    values: Any
    kind: InterpolantKind = "bspline"
    function: ca.Function = field(init=False)

    def __post_init__(self) -> None:
        if self.kind not in get_args(InterpolantKind):
            raise StatementError(
                f"the table '{self.name}' is of the kind {self.kind!r}; choose bspline or linear"
            )
        axes = self._axes()
        values = np.asarray(self.values, dtype=float)
        shape = tuple(axis.size for axis in axes)
        if values.shape != shape or not np.all(np.isfinite(values)):
            raise StatementError(
                f"the table '{self.name}' needs finite values of the shape {shape}, one for each "
                f"point of its grid; the given ones have the shape {values.shape}"
            )
        object.__setattr__(self, "points", axes)
        object.__setattr__(self, "values", values)
        # CasADi's first axis varies fastest
        flat = values.ravel(order="F")
        function = ca.interpolant(self.name, self.kind, list(axes), flat)
        object.__setattr__(self, "function", function)
        _INTERPOLANTS[hash(function)] = self

    def _axes(self) -> tuple[Array, ...]:
        """The points of each axis; StatementError unless they increase."""
        single = np.ndim(self.points[0]) == 0
        axes = tuple(np.asarray(a, float) for a in ([self.points] if single else self.points))
        least = 4 if self.kind == "bspline" else 2
        for axis in axes:
            if axis.ndim != 1 or axis.size < least or not np.all(np.diff(axis) > 0):
                raise StatementError(
                    f"an axis of the table '{self.name}' is {axis}; give at least {least} "
                    "increasing numbers"
                )
        return axes

    def __call__(self, *arguments: Any) -> ca.SX:
        """The interpolated value, an expression of the arguments."""
        if len(arguments) != len(self.points):
            raise StatementError(
                f"the table '{self.name}' has {len(self.points)} axes, but is called with "
                f"{len(arguments)} arguments"
            )
        return self.function(ca.vertcat(*[ca.SX(argument) for argument in arguments]))


def interpolant_of(function: ca.Function) -> Interpolant | None:
    """The table that a CasADi function belongs to, if a `Interpolant` made it."""
    return _INTERPOLANTS.get(hash(function))
