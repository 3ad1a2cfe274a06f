"""Limits as a message prints them: a user who types the number back keeps the limit."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Context

DIGITS = 6


def up(value: float, digits: int = DIGITS) -> str:
    """A number that is to be reached at least, such as a cap to raise, rounded up."""
    return _rounded(value, digits, ROUND_CEILING)


def down(value: float, digits: int = DIGITS) -> str:
    """A number that is to be reached at most, such as a lower limit, rounded down."""
    return _rounded(value, digits, ROUND_FLOOR)


def _rounded(value: float, digits: int, rounding: str) -> str:
    return f"{float(Context(prec=digits, rounding=rounding).create_decimal(value)):.{digits}g}"
