"""What the head of a template states: the columns of a table, and what the device makes of them."""

from __future__ import annotations

from dataclasses import dataclass

from studies.common.configuration import (
    boolean,
    check,
    choice,
    choices,
    key,
    optional_key,
    positive,
    whole,
)
from studies.common.exit_codes import StudyError
from studies.drive.schema import INTERPOLATIONS

COLUMNS = ("time", "duration", "position", "displacement", "velocity", "acceleration")
NEEDED = {"hermite": ("velocity",), "quintic": ("velocity", "acceleration")}  # beside positions
POSITIONS = ("exact", "rounded", "counts")


@dataclass(frozen=True)
class TableLayout:
    """A table that a device takes.

    Attributes
    ----------
    columns : numbers of a point; without a time and a duration all steps are equal. With durations
        or displacements the first point may be left out: the axis rests there.
    interpolation : that the device does between its points; None is that of the drive.
    positions : whether they are rounded to counts of the encoder where the drive states them, and
        whether positions and their rates are written in counts, which the drive has to state then.
    most : points that the device holds where the drive states no buffer; None is any number.
    segments : whether what it holds are segments, which are one fewer than the points.
    sample : of which all times are multiples [s]; None is any time.
    largest : position in counts that a number of the device can hold; None is any.

    Raises
    ------
    StudyError
        If a value is wrong, or a column is lacking.
    """

    columns: tuple[str, ...] = key(choices(COLUMNS), "", "numbers of a point")
    interpolation: str | None = optional_key(
        choice(INTERPOLATIONS), "", "what the device does between its points; else the drive's"
    )
    positions: str = key(
        choice(POSITIONS), "", "exact, rounded to counts, or written in counts", default="exact"
    )
    most: int | None = optional_key(whole(2), "", "most points that the device holds")
    segments: bool = key(boolean, "", "whether it holds segments instead of points", default=False)
    sample: float | None = optional_key(positive, "s", "of which all times are multiples")
    largest: int | None = optional_key(whole(1), "", "largest position, in counts")

    def __post_init__(self) -> None:
        check(self)
        if not {"position", "displacement"} & set(self.columns):
            raise StudyError("columns has no position; add position or displacement")
        if self.lacks(self.interpolation):
            raise StudyError(
                f"interpolation is {self.interpolation!r}, which needs "
                f"{' and '.join(NEEDED[self.interpolation or ''])}; add them to columns"
            )

    def lacks(self, interpolation: str | None) -> bool:
        """Whether an interpolation needs more than there is at a point."""
        return not set(NEEDED.get(interpolation or "", ())) <= set(self.columns)

    @property
    def even(self) -> bool:
        """Whether all steps have to be equal."""
        return not {"time", "duration"} & set(self.columns)

    @property
    def first(self) -> int:
        """Place of the first point that has to be written."""
        return 1 if {"duration", "displacement"} & set(self.columns) else 0

    @property
    def in_counts(self) -> bool:
        """Whether positions and their rates are written in counts."""
        return self.positions == "counts"

    @property
    def whole_velocities(self) -> bool:
        """Whether velocities are in whole counts a second."""
        return self.in_counts and "velocity" in self.columns
