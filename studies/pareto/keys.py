"""How the keys of a trade-off are read, whatever mechanism it is of."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

from studies.common.configuration import Reader, as_number, choice, positive, whole
from studies.common.exit_codes import StudyError, quoted

SLICES = (2, 50)  # fewest and most
# points of a front, and of each slice of three objectives, where nothing is stated
FRONT, SLICE = 40, 10
SECONDS = 1200.0  # that all slices may take where nothing is stated
SLICES_MEANING = (
    "of three objectives: how many slices, each under one limit on the objective that is the "
    "colour of the figure, or a list of these limits in its SI unit; 7 unless stated"
)
COARSE_MEANING = "a sketch: few points, from one start, on a coarse mesh"


def objectives(known: Sequence[str]) -> Reader:
    """Reader of two or three different objectives, as a list or with commas."""

    def read(name: str, value: Any) -> tuple[str, ...]:
        items = [word.strip() for word in value.split(",")] if isinstance(value, str) else value
        if not isinstance(items, list | tuple) or len(items) not in (2, 3):
            raise StudyError(
                f"{name} is {quoted(value)}; give two or three out of {', '.join(known)}"
            )
        names = tuple(choice(known)(name, item) for item in items)
        for one in names:
            if (times := names.count(one)) > 1:
                raise StudyError(
                    f"{name} names {one} {'twice' if times == 2 else 'three times'}; a trade-off "
                    "is between different objectives"
                )
        return names

    return read


def in_order(names: Sequence[str], limited: Sequence[str]) -> tuple[str, ...]:
    """Objectives by how easily each is limited, as a list has them; the last one is least."""
    order = {name: place for place, name in enumerate(dict.fromkeys(limited))}
    return tuple(sorted(names, key=lambda name: order.get(name, len(order))))


def slices(name: str, value: Any) -> int | tuple[float, ...]:
    """So many slices, or the limit of each: a list, or a text with commas."""
    if isinstance(value, str):
        words = [word.strip() for word in value.split(",")]
        value = [as_number(word) for word in words] if len(words) > 1 else as_number(value.strip())
    if not isinstance(value, list | tuple):
        return whole(*SLICES)(name, value)
    limits = tuple(positive(name, one) for one in value)
    if len(limits) < SLICES[0] or any(b <= a for a, b in itertools.pairwise(limits)):
        raise StudyError(
            f"{name} is {', '.join(f'{one:g}' for one in limits)}; give at least two limits, each "
            "above the one before, or how many slices there are to be"
        )
    return limits


def check_sliced(name: str, value: object, objectives: Sequence[str]) -> None:
    """Refuse slices where two objectives are traded, of which none is sliced."""
    if value is not None and len(objectives) == 2:
        raise StudyError(
            f"{name} is for three objectives, of which one is limited by slices, but "
            f"{name.removesuffix('slices')}objectives has {' and '.join(objectives)}; leave it "
            "out, or add one"
        )
