"""What every part of the benchmark is told, and what a part is."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

from studies.common.console import Console, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Record = Mapping[str, Any]

# name of a part, and of its module in studies.speed, with its line of help
PARTS = {
    "race": "problems A and B, every contestant, medians",
    "curve": "accuracy against time of every contestant",
    "benchmarks": "a pass over the problems with known optima",
    "arm": "the arm's stage of 86 s",
    "growth": "problem B on meshes of 100 to 20,000 intervals, memory included",
    "modules": "problem B with 6 to 1000 modules",
    "elements": "a pendulum of 4 to 64 ANCF elements",
    "imports": "what loads, and how long it takes",
}


@dataclass(frozen=True)
class Setup:
    """What was asked for.

    Attributes
    ----------
    repeats : runs of which a median is taken.
    limit : of one run [s].
    peers : whether other tools take part.
    environments : folder of their environments.
    """

    console: Console
    repeats: int
    limit: float
    peers: bool
    environments: Path


class Part(Protocol):
    """The module of a part."""

    def measure(self, setup: Setup) -> Iterator[Record]:
        """Measure, and hand out the record each time something was added to it."""

    def tables(self, record: Record) -> list[Table]:
        """What is printed."""

    def draw(self, record: Record) -> Figure | None:
        """The figure, if there is one."""


def part(name: str) -> Part:
    """The module of the part `name`."""
    return cast(Part, importlib.import_module(f"studies.speed.{name}_part"))
