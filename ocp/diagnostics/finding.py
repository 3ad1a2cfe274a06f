"""What a diagnostic says of an answer."""

from __future__ import annotations

from dataclasses import dataclass

from ocp.mesh.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Finding:
    """One number, what it may be at most, and what it means.

    Attributes
    ----------
    name : str
    value, tolerance : float
        Of the same unit.
    sentence : str
    start : Trajectory or None
        A motion from which a solve should reach a better answer, if one was found.
    open : bool
        Whether it could not be finished, so that the value says nothing.
    """

    name: str
    value: float
    tolerance: float
    sentence: str
    start: Trajectory | None = None
    open: bool = False

    @property
    def passed(self) -> bool:
        """Whether the value is a number within its tolerance."""
        return not self.open and bool(self.value <= self.tolerance)

    @property
    def failed(self) -> bool:
        """Whether it was finished, and the value is no number within its tolerance."""
        return not (self.passed or self.open)

    def __str__(self) -> str:
        if self.open:
            return f"open  {self.name}: {self.sentence}"
        return (
            f"{'pass' if self.passed else 'FAIL'}  {self.name}: {self.value:.1e} of "
            f"{self.tolerance:.0e} allowed; {self.sentence}"
        )
