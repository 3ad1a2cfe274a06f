"""Limits as a message prints them: a user who types the number back keeps the limit."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal

DIGITS = 6


def up(value: float) -> str:
    """A number that is to be reached at least, such as a cap to raise: six digits, none below."""
    return _rounded(value, ROUND_CEILING)


def down(value: float) -> str:
    """A number that is to be reached at most, such as a lower limit: six digits, none above."""
    return _rounded(value, ROUND_FLOOR)


def _rounded(value: float, rounding: str) -> str:
    exact = Decimal(value)
    place = Decimal(1).scaleb(exact.adjusted() - DIGITS + 1)
    return f"{float(exact.quantize(place, rounding=rounding)):.{DIGITS}g}"
