"""A row of the comparison, and how it comes to its verdict.

A row is defined by a title: "V-B: length of the big arm [m]" has place, quantity and unit. The unit
is 1 if there is none.

Each verdict has a basis that is computed, and `holds` says whether it was found. A row whose
verdict does not hold fails the study.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from enum import StrEnum

import numpy as np

from ocp.arrays import Array

FORMULA = 1e-9  # relative; a formula of the paper and its twin in the models differ by rounding
ROUNDED = 0.5 + 1e-9  # of the last printed digit
EXACT = 1e-12  # relative; rounding of a unit, such as from degrees
DIFFERENT = 1e-3  # relative; what a slip is at least off
WRITTEN = "formula"  # in place of a printed number


class PaperVerdict(StrEnum):
    """The verdict of a row of the comparison."""

    EQUAL = "equal to the printed digits"
    TAKEN = "taken from the paper"
    SHAPE = "same shape"
    MISPRINT = "misprint"
    NOT_SHARED = "not reproduced"
    ASSUMPTION = "our assumption"
    NOT_READABLE = "not readable"


@dataclass(frozen=True)
class Entry:
    """One number, formula or curve of the paper, compared with ours.

    Attributes
    ----------
    place : equation, table, figure or section of the paper.
    quantity, unit : what.
    printed : the number as it is printed, or that follows from what is; empty where there is
        none, "formula" if a formula is compared with ours.
    ours : value of the models; for a formula the largest relative difference.
    verdict : of the row.
    reason : basis of the verdict.
    holds : whether this basis was found.
    """

    place: str
    quantity: str
    unit: str
    printed: str
    ours: float
    verdict: PaperVerdict
    reason: str
    holds: bool

    @property
    def printed_value(self) -> float:
        """The printed number, nan if there is none; a formula and its twin differ by zero."""
        if self.printed == WRITTEN:
            return 0.0
        return float(self.printed) if self.printed else math.nan

    @property
    def difference(self) -> float:
        """Ours less the printed number, relative to it where it is not zero."""
        printed = self.printed_value
        return self.ours - printed if printed == 0.0 else self.ours / printed - 1.0

    @property
    def difference_text(self) -> str:
        """The difference for people."""
        difference = self.difference
        if not math.isfinite(difference):
            return "-"
        if self.printed_value == 0.0:
            return f"{difference:+.3g}"
        if abs(difference) < EXACT:
            return "0"
        digits = ".0f" if abs(difference) > 0.99 else ".2g"
        return f"{100 * difference:+{digits}} %"

    @property
    def verdict_text(self) -> str:
        """The verdict for people, which says so if it was not found."""
        return self.verdict.value if self.holds else f"NOT FOUND: {self.verdict.value}"

    @property
    def key(self) -> str:
        """A name for programs."""
        words = re.sub(r"[^a-z0-9]+", "-", f"{self.place} {self.quantity}".lower())
        return words.strip("-")


def apart(ours: Array, written: Array) -> float:
    """Largest difference of two arrays of one shape, relative to the largest written value."""
    return float(np.abs(ours - written).max() / np.abs(written).max())


def agrees(printed: str, ours: float) -> bool:
    """Whether a number rounds to the printed digits."""
    number = Decimal(printed)
    unit = Decimal(1).scaleb(int(number.as_tuple().exponent))
    return math.isfinite(ours) and abs(ours - float(number)) <= ROUNDED * float(unit)


def _named(title: str) -> tuple[str, str, str]:
    """Place, quantity and unit of a title."""
    place, _, what = title.partition(": ")
    stated = re.fullmatch(r"(.*) \[(.*)\]", what)
    return (place, stated[1], stated[2]) if stated else (place, what, "1")


def equal(title: str, printed: str, ours: float, reason: str = "") -> Entry:
    """A row whose printed number ours has to round to."""
    holds = agrees(printed, ours)
    return Entry(*_named(title), printed, ours, PaperVerdict.EQUAL, reason, holds)


def exact(title: str, printed: str, ours: float, reason: str = "") -> Entry:
    """A count or a coefficient: ours has to be the printed number itself, not only round to it."""
    holds = math.isclose(ours, float(printed), rel_tol=EXACT)
    return Entry(*_named(title), printed, ours, PaperVerdict.EQUAL, reason, holds)


def taken(title: str, printed: str, ours: float, reason: str = "") -> Entry:
    """A parameter that our models have from the paper: it agrees, and proves nothing."""
    entry = exact(title, printed, ours, reason)
    return dataclasses.replace(entry, verdict=PaperVerdict.TAKEN)


def formula(title: str, difference: float, reason: str = "") -> Entry:
    """A printed formula: written out here, it has to give what the models give.

    Parameters
    ----------
    difference : largest relative difference between the two.
    """
    holds = abs(difference) < FORMULA
    reason = reason or "the printed formula, written out, gives what the models give"
    return Entry(*_named(title), WRITTEN, difference, PaperVerdict.EQUAL, reason, holds)


def shape(title: str, ours: float, checks: Mapping[str, bool], printed: str = "") -> Entry:
    """A curve or a statement in words: each check is one of its features."""
    failed = [name for name, passed in checks.items() if not passed]
    said = "; ".join(checks)
    reason = said if not failed else f"{said}; NOT FOUND: {'; '.join(failed)}"
    return Entry(*_named(title), printed, ours, PaperVerdict.SHAPE, reason, not failed)


def misprint(title: str, printed: str, ours: float, reason: str, shown: bool = True) -> Entry:
    """A slip of the paper: what it prints elsewhere gives `ours`, and `shown` says what else."""
    differs = True
    if printed:
        off = abs(ours - float(printed))
        differs = off > DIFFERENT * max(abs(ours), abs(float(printed)))
    holds = differs and shown
    return Entry(*_named(title), printed, ours, PaperVerdict.MISPRINT, reason, holds)


def not_shared(title: str, printed: str, ours: float, reason: str, shown: bool = True) -> Entry:
    """A number or a statement that our models do not give, without proof that it is a slip."""
    entry = misprint(title, printed, ours, reason, shown)
    return dataclasses.replace(entry, verdict=PaperVerdict.NOT_SHARED)


def assumption(title: str, ours: float, reason: str, printed: str = "") -> Entry:
    """What the paper leaves open: ours is a choice."""
    holds = math.isfinite(ours)
    return Entry(*_named(title), printed, ours, PaperVerdict.ASSUMPTION, reason, holds)


def not_readable(title: str, ours: float, reason: str) -> Entry:
    """A curve without numbers, or a sign that the text at hand may have lost."""
    holds = math.isfinite(ours)
    return Entry(*_named(title), "", ours, PaperVerdict.NOT_READABLE, reason, holds)
