"""Fields of a dataclass that are worked out when they are first read.

Some of what a solve returns takes longer to work out than the solve of a small problem, and a
caller may never read it: a controller needs the first force of a motion, and no verdict.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar, overload

T = TypeVar("T")


@dataclass(frozen=True, eq=False, repr=False)
class Later(Generic[T]):
    """A value for a `Lazy` field that is worked out when the field is first read.

    Attributes
    ----------
    make : callable
        Works it out. The field lets go of it afterwards.
    """

    make: Callable[[], T]


class Lazy(Generic[T]):
    """A field of a dataclass that takes a value, or a `Later` of it: ``name: Lazy[T] = Lazy()``."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Lazy[T]: ...
    @overload
    def __get__(self, instance: object, owner: type) -> T: ...
    def __get__(self, instance: object | None, owner: type) -> Lazy[T] | T:
        if instance is None:
            raise AttributeError(self._name)  # tells `dataclass` that there is no default
        value = vars(instance)[self._name]
        if isinstance(value, Later):
            value = vars(instance)[self._name] = value.make()
        known: T = value
        return known

    def __set__(self, instance: object, value: T | Later[T]) -> None:
        vars(instance)[self._name] = value


def read_later(instance: object, name: str, read: Callable[[Any], T]) -> T | Later[T]:
    """Something of a lazy field: now if the field is known, else when it is asked for.

    Parameters
    ----------
    instance, name
        Whose field it is, and its name.
    read : callable
        Takes it from the field's value.
    """
    if isinstance(vars(instance)[name], Later):
        return Later(lambda: read(getattr(instance, name)))
    return read(getattr(instance, name))
