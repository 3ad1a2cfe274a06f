"""JSON and TOML that anybody may have written, within limits that all readers behind rely on.

Python's own readers end in errors of several kinds if a text is nested deeply or holds a whole
number of many digits, and brackets take up to 60 times their room in memory.
"""

from __future__ import annotations

import json
import sys
import tomllib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

DEEPEST = 60  # lists and tables in each other: ours have a handful
# lists and tables of a text: one takes up to 250 bytes, and 10 MB of text less than 150 MB
GROUPS, TEXT_OF_ONE = 200_000, 30


def parsed_json(text: str) -> Any:
    """The content of a text in JSON.

    Raises
    ------
    ValueError
        If it is none, is nested too deeply, or holds a whole number beyond a double.
    """
    return _parsed(text, json.loads)


def parsed_toml(text: str) -> dict[str, Any]:
    """The content of a text in TOML.

    Raises
    ------
    ValueError
        As `parsed_json`; if it is no TOML, a `tomllib.TOMLDecodeError`, which is one.
    """
    content: dict[str, Any] = _parsed(text, tomllib.loads)
    return content


def _parsed(text: str, read: Callable[[str], Any]) -> Any:
    if text.count("[") + text.count("{") > GROUPS + len(text) // TEXT_OF_ONE:
        raise ValueError("it has too many lists and tables for its size")
    try:
        content = read(text)
    except RecursionError as error:
        raise _too_deep() from error
    except ValueError as error:
        if type(error) is ValueError:  # of a number that has more digits than Python reads
            raise _too_large("of thousands of digits") from error
        raise
    _check(content)
    return content


def _check(content: Any) -> None:
    """Refuse lists and tables that are nested too deeply, and whole numbers beyond a double."""
    groups: list[Any] = [[content]]
    for _ in range(DEEPEST + 1):
        items = [item for group in groups for item in _items(group)]
        if any(type(item) is int and abs(item) > sys.float_info.max for item in items):
            raise _too_large("beyond 1.8e308")
        groups = [item for item in items if isinstance(item, Mapping | list)]
        if not groups:
            return
    raise _too_deep()


def _items(group: Any) -> Iterable[Any]:
    return group.values() if isinstance(group, Mapping) else group


def _too_deep() -> ValueError:
    return ValueError(f"its lists or tables are nested deeper than {DEEPEST}")


def _too_large(how: str) -> ValueError:
    return ValueError(f"it holds a whole number {how}; write it as 1.5e300")
