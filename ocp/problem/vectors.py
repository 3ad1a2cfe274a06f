"""Vectors of signals and unknowns: ``State("q", shape=4)``, taken apart where they are stated.

Everything behind the statement sees scalar components, named ``q[0]``, ``q[1]``, ...
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ocp.errors import StatementError

_BY_COMPONENT = ("lower", "upper", "scale", "guess")  # one for all, or a list with one for each


@dataclass(frozen=True, eq=False, repr=False)
class Vector(ca.GenericExpressionCommon):
    """A column of symbols; ``q[i]`` is one of them, and CasADi's functions take it as a vector.

    Attributes
    ----------
    name, unit : str
    components : tuple of Symbol
        In their order.
    """

    name: str
    unit: str
    components: tuple[Any, ...]

    def __SX__(self) -> ca.SX:
        return ca.vertcat(*[component.symbol for component in self.components])

    def __neg__(self) -> ca.SX:
        return -self.__SX__()

    def __len__(self) -> int:
        return len(self.components)

    def __iter__(self) -> Iterator[Any]:
        return iter(self.components)

    def __getitem__(self, index: Any) -> Any:
        """The component at a number, or the components of a slice as a tuple."""
        return self.components[index]

    __hash__ = object.__hash__

    def __repr__(self) -> str:
        kind = type(self.components[0]).__name__
        return f"{kind}({self.name!r}, {self.unit!r}, shape={len(self)})"


def vector_of(kind: type, shape: Any, name: Any, unit: str = "1", **options: Any) -> Vector:
    """A vector of symbols of one kind.

    Raises
    ------
    StatementError
        If the shape is no positive whole number, or a list has another number of entries.
    """
    if isinstance(shape, bool) or not isinstance(shape, int) or shape < 1:
        raise StatementError(
            f"the shape of '{name}' is {shape!r}; give the number of its components, such as "
            "shape=4"
        )
    parts = {
        key: _by_component(value, shape, f"the argument '{key}' of '{name}'")
        if key in _BY_COMPONENT
        else [value] * shape
        for key, value in options.items()
    }
    components = [
        kind(f"{name}[{i}]", unit, **{key: values[i] for key, values in parts.items()})
        for i in range(shape)
    ]
    return Vector(name, components[0].unit, tuple(components))


def by_component(what: str, given: Mapping[Any, Any]) -> dict[Any, Any]:
    """A mapping of a phase with the components of each vector in its place.

    Parameters
    ----------
    what : of the arguments "dynamics", "initial", "final" and "guess" of a phase.
    given : mapping of signals or vectors to what is stated of them.

    Raises
    ------
    StatementError
        If something is stated for another number of components than the vector has.
    """
    plain: dict[Any, Any] = {}
    for key, value in given.items():
        if not isinstance(key, Vector):
            plain[key] = value
            continue
        where = f"{_TITLES[what]} of '{key.name}'"
        plain.update(zip(key, _stated(what, value, len(key), where), strict=True))
    return plain


_TITLES = {
    "dynamics": "the derivative",
    "initial": "the initial value",
    "final": "the final value",
    "guess": "the guess",
}


def _stated(what: str, value: Any, count: int, where: str) -> Sequence[Any]:
    """What is stated of a vector, for each component."""
    if what == "guess" and callable(value):
        return [lambda t, i=i: np.asarray(value(t))[i] for i in range(count)]
    if not isinstance(value, tuple):
        return _by_component(value, count, where)
    if len(value) != 2 or not all(np.ndim(part) for part in value):
        raise StatementError(
            f"{where} is the tuple {value!r}, which could be two limits or {count} values; give a "
            f"list of {count} values, or limits as ([lower, ...], [upper, ...])"
        )
    if what == "guess":
        times, values = value
        return [(times, np.asarray(values)[:, i]) for i in range(count)]
    lower, upper = (_by_component(part, count, where) for part in value)
    return list(zip(lower, upper, strict=True))


def _by_component(value: Any, count: int, where: str) -> Sequence[Any]:
    """A list with an entry for each component; a single value counts for all."""
    column = value.__SX__() if isinstance(value, Vector) else value
    if isinstance(column, (ca.SX, ca.DM)) and not column.is_scalar():
        entries: Sequence[Any] = ca.vertsplit(ca.densify(column)) if column.is_column() else ()
    elif np.ndim(column) and not isinstance(column, str):
        entries = list(column)
    else:
        entries = [column] * count
    if len(entries) != count:
        raise StatementError(
            f"{where} has {len(entries)} entries; give {count}, one for each component"
        )
    return entries
