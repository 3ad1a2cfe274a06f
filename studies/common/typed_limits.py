"""Limits in messages: a user who types the printed number back gets past the limit."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Context

DIGITS = 6


def upper_limit(value: float, digits: int = DIGITS) -> str:
    """The value of a limit that has to be at least this, rounded up to some digits."""
    return _rounded(value, digits, ROUND_CEILING)


def lower_limit(value: float, digits: int = DIGITS) -> str:
    """The value of a limit that has to be at most this, rounded down to some digits."""
    return _rounded(value, digits, ROUND_FLOOR)


def _rounded(value: float, digits: int, towards: str) -> str:
    rounded = Context(prec=digits, rounding=towards).create_decimal(value)
    return f"{float(rounded):.{digits}g}"
