"""Fields of a dataclass that are worked out when they are first read.

Some of what a solve returns takes longer to work out than the solve of a small problem, and a
caller may never read it: a controller needs the first force of a motion, and no verdict.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar, cast

T = TypeVar("T")


@dataclass(frozen=True, eq=False, repr=False)
class _Later:
    """Works a value out."""

    make: Callable[[], Any]


def later(make: Callable[[], T]) -> T:
    """A value for a lazy field, which is worked out when the field is first read."""
    return cast(T, _Later(make))


def lazy_fields(*names: str) -> Callable[[type[T]], type[T]]:
    """Let some fields of a dataclass be given `later`; others may be, too, by their values."""

    def made(kind: type[T]) -> type[T]:
        for name in names:
            setattr(kind, name, _Lazy(name))
        return kind

    return made


def read_later(instance: object, name: str, read: Callable[[Any], T]) -> T:
    """Something of a lazy field: now if the field is known, else when it is asked for.

    Parameters
    ----------
    instance, name
        Whose field it is, and its name.
    read : callable
        Takes it from the field's value.
    """
    if isinstance(vars(instance)[name], _Later):
        return later(lambda: read(getattr(instance, name)))
    return read(getattr(instance, name))


@dataclass(frozen=True, eq=False, repr=False)
class _Lazy:
    """The descriptor of a lazy field, which keeps a value among those of the instance."""

    name: str

    def __get__(self, instance: object | None, owner: type) -> Any:
        if instance is None:
            return self
        value = vars(instance)[self.name]
        if isinstance(value, _Later):
            value = vars(instance)[self.name] = value.make()
        return value

    def __set__(self, instance: object, value: Any) -> None:
        vars(instance)[self.name] = value
