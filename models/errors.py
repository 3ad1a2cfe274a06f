"""The one error of the models: it names the thing, its value and the remedy."""

from __future__ import annotations

from math import isfinite


class ModelError(ValueError):
    """A model was given parameters or a motion outside the range where it holds."""


def require(condition: bool, message: str) -> None:
    """Raise ModelError with `message` unless `condition` holds."""
    if not condition:
        raise ModelError(message)


def require_positive(owner: str, **values: float) -> None:
    """Raise ModelError unless every value is finite and positive."""
    for name, value in values.items():
        text = name.replace("_", " ")
        require(
            isfinite(value) and value > 0,
            f"{owner}: {text} is {value:g}; give a finite value above zero.",
        )


def require_not_negative(owner: str, **values: float) -> None:
    """Raise ModelError unless every value is finite and at least zero."""
    for name, value in values.items():
        text = name.replace("_", " ")
        require(
            isfinite(value) and value >= 0,
            f"{owner}: {text} is {value:g}; give a finite value of zero or more.",
        )
