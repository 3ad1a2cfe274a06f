"""How the keys of a front are read, whatever mechanism it is of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from studies.common.configuration import Reader, choice
from studies.common.exit_codes import StudyError, quoted

COARSE_POINTS = 6
COARSE_MEANING = "a sketch: few points, from one start, on a coarse mesh"


def objectives(known: Sequence[str], limited: Sequence[str]) -> Reader:
    """Reader of two different objectives, as a list or with commas; the one to limit comes first.

    Parameters
    ----------
    known : that there are.
    limited : the same, by how easily each is limited; those that are not listed come last.
    """
    order = {name: place for place, name in enumerate(dict.fromkeys(limited))}

    def read(name: str, value: Any) -> tuple[str, ...]:
        items = [word.strip() for word in value.split(",")] if isinstance(value, str) else value
        if isinstance(items, list | tuple) and len(items) == 3:
            raise StudyError(
                f"{name} is {quoted(value)}; give two of them, and limit the third, or sweep over "
                "limits on it: antenna-ocp sweep with the subject 'pareto truss' or 'pareto arm'"
            )
        if not isinstance(items, list | tuple) or len(items) != 2:
            raise StudyError(f"{name} is {quoted(value)}; give two out of {', '.join(known)}")
        one, other = (choice(known)(name, item) for item in items)
        if one == other:
            raise StudyError(
                f"{name} names {one} twice; a trade-off is between different objectives"
            )
        return tuple(sorted((one, other), key=lambda each: order.get(each, len(order))))

    return read
