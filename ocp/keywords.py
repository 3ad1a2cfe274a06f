"""Wrong keywords, answered with what to write instead."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from ocp.errors import StatementError

Target = TypeVar("Target", bound=Callable[..., Any])
Remedy = str | Callable[[Any], str]


def checked_keywords(former: Mapping[str, Remedy] | None = None) -> Callable[[Target], Target]:
    """Let a function or a dataclass answer a wrong keyword in one sentence.

    Parameters
    ----------
    former : mapping of str to str or callable, optional
        What to write instead of each keyword that was once right, as a part of a sentence.
        ``{value}`` in it stands for the value given; a callable receives that value.

    Returns
    -------
    callable
        A decorator. What it decorates raises `StatementError` for a keyword it does not have, and
        suggests the nearest one.
    """

    def decorate(target: Target) -> Target:
        name = target.__name__
        if isinstance(target, type):
            # the constructor that `dataclass` has written
            init = _checked(vars(target)["__init__"], name, former or {})
            setattr(target, "__init__", init)  # noqa: B010
            return target
        checked: Any = _checked(target, name, former or {})
        return checked

    return decorate


def _checked(
    function: Callable[..., Any], name: str, former: Mapping[str, Remedy]
) -> Callable[..., Any]:
    keywords = [word for word in inspect.signature(function).parameters if word != "self"]

    @functools.wraps(function)
    def called(*arguments: Any, **given: Any) -> Any:
        for word, value in given.items():
            if word not in keywords:
                raise StatementError(_answer(name, word, value, keywords, former))
        return function(*arguments, **given)

    return called


def _answer(
    name: str, word: str, value: Any, keywords: list[str], former: Mapping[str, Remedy]
) -> str:
    """One sentence on a keyword that is not there."""
    if word in former:
        remedy = former[word]
        text = remedy(value) if callable(remedy) else remedy.format(value=repr(value))
        return f"{name} has no keyword '{word}' any more; {text}"
    return f"{name} has no keyword '{word}'; {nearest(word, keywords)}"


def nearest(word: str, known: list[str]) -> str:
    """A question after the nearest of the known words, or a list of all where none is near."""
    from difflib import get_close_matches  # only when something is wrong

    near = get_close_matches(word, known, n=1)
    return f"did you mean '{near[0]}'?" if near else f"there are {', '.join(known)}"
