"""Objects made by keywords: wrong ones answered with what to write instead, and a short `repr`."""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from ocp.errors import StatementError

Kind = TypeVar("Kind", bound=type)
Target = TypeVar("Target", bound=Callable[..., Any])
Remedy = str | Callable[[Any], str]
Remedies = Mapping[str, Remedy]


def checked_keywords(
    elsewhere: Mapping[str, Remedy] | None = None,
) -> Callable[[Target], Target]:
    """Let a function or a dataclass answer a wrong keyword in one sentence.

    Parameters
    ----------
    elsewhere : mapping of str to str or callable, optional
        What to write instead of keywords of other tools, as a part of a sentence. ``{value}`` in it
        stands for the value given; a callable receives that value.

    Returns
    -------
    callable
        A decorator. What it decorates raises `StatementError` for a keyword it does not have, and
        suggests the nearest one. A class does so too where an argument is missing.
    """
    remedies = elsewhere or {}

    def decorate(target: Target) -> Target:
        if isinstance(target, type):
            # what help and editors show; else it would be that of `__new__`, which takes anything
            setattr(target, "__signature__", _Signature())  # noqa: B010
            setattr(target, "__new__", _checked_new(remedies))  # noqa: B010
            return target
        checked: Any = _checked(target, remedies)
        return checked

    return decorate


def checked_methods(*names: str) -> Callable[[Kind], Kind]:
    """Let methods of a class answer a wrong keyword in one sentence, as `checked_keywords` does."""

    def decorate(target: Kind) -> Kind:
        for name in names:
            setattr(target, name, _checked(vars(target)[name], {}))
        return target

    return decorate


class _Signature:
    """The signature of a class, worked out when it is asked for: many imports never do."""

    def __get__(self, instance: object, kind: Any) -> inspect.Signature:
        signature = inspect.signature(kind.__init__)
        return signature.replace(parameters=list(signature.parameters.values())[1:])


def _checked_new(remedies: Remedies) -> Callable[..., Any]:
    """A `__new__` of a dataclass, which sees the keywords before the constructor does."""

    def checked_new(kind: Any, /, *arguments: Any, **given: Any) -> Any:
        entries = [entry for entry in dataclasses.fields(kind) if entry.init]
        keywords = [entry.name for entry in entries]
        _check(kind.__name__, given, keywords, remedies)

        # copies and files make an object without any argument, and fill it afterwards
        absent = [
            e.name for e in entries[len(arguments) :] if _is_needed(e) and e.name not in given
        ]
        if absent and (arguments or given):
            needed = [f"{e.name}=..." if e.kw_only else e.name for e in entries if _is_needed(e)]
            others = [e.name for e in entries if not _is_needed(e)]
            rest = f"; {', '.join(others)} may be left out" if others else ""
            call = f"{kind.__name__}({', '.join(needed)})"
            raise StatementError(f"{kind.__name__} has no {_listed(absent)}; write {call}{rest}")
        return object.__new__(kind)

    return checked_new


def _is_needed(entry: dataclasses.Field[Any]) -> bool:
    """Whether a field of a dataclass has no default."""
    missing = dataclasses.MISSING
    return entry.default is missing and entry.default_factory is missing


def _listed(words: list[str]) -> str:
    return " and no ".join(f"'{word}'" for word in words)


def _checked(function: Callable[..., Any], remedies: Remedies) -> Callable[..., Any]:
    """The function behind a check of its keywords."""
    # as `inspect.signature` has them, which takes a hundred times as long at every import
    code = function.__code__
    arguments_count = code.co_argcount + code.co_kwonlyargcount
    keywords = [word for word in code.co_varnames[:arguments_count] if word != "self"]

    @functools.wraps(function)
    def called(*arguments: Any, **given: Any) -> Any:
        _check(function.__name__, given, keywords, remedies)
        return function(*arguments, **given)

    return called


def _check(name: str, given: Mapping[str, Any], keywords: list[str], remedies: Remedies) -> None:
    """StatementError if one of the keywords given is not there."""
    for word, value in given.items():
        if word in keywords:
            continue
        if word in remedies:
            remedy = remedies[word]
            text = remedy(value) if callable(remedy) else remedy.format(value=repr(value))
            raise StatementError(f"{name} has no keyword '{word}'; {text}")
        raise StatementError(f"{name} has no keyword '{word}'; {nearest(word, keywords)}")


def as_written(instance: Any) -> str:
    """A dataclass as one would write it: the keywords that differ from their defaults."""
    written = []
    for entry in dataclasses.fields(instance):
        value, default = getattr(instance, entry.name), entry.default
        if entry.default_factory is not dataclasses.MISSING:
            default = entry.default_factory()
        # symbols compare to an expression, which is neither true nor false
        if entry.repr and (value != default) is not False:
            written.append(f"{entry.name}={value!r}")
    return f"{type(instance).__name__}({', '.join(written)})"


def nearest(word: str, known: list[str]) -> str:
    """A question after the nearest of the known words, or a list of all where none is near."""
    from difflib import get_close_matches  # only when something is wrong

    near = get_close_matches(word, known, n=1)
    return f"did you mean '{near[0]}'?" if near else f"there are {', '.join(known)}"
