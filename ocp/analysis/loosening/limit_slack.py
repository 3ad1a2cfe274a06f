"""The unknown that moves one limit."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from ocp.problem.symbols import Unknown

Side = Literal["lower", "upper"]


@dataclass(frozen=True, eq=False, repr=False)
class LimitSlack:
    """The unknown that moves one limit, and where.

    Attributes
    ----------
    path : expressions by phase, for a limit along phases.
    end : phase and index of the breakpoint, for a boundary value.
    """

    name: str
    side: Side
    limit: Any
    unit: str
    size: float
    unknown: Unknown
    path: dict[str, Any] = field(default_factory=dict)
    end: tuple[str, int] | None = None
