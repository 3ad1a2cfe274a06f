"""A parameter of the model of a result, as a report lists it: meaning, unit, value and source."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class ParameterLine:
    """One parameter: what it is called, what it is, and where its value comes from."""

    name: str
    meaning: str
    unit: str
    value: Any
    source: str


def in_words(name: str) -> str:
    """The name of a field as words."""
    return name.replace("_", " ")
