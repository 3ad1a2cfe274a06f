"""The parts of `python -m benchmarks.race`: their names, and what each is told and gives."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, cast

from studies.common.console import Console, Table

Measured = Mapping[str, Any]


# One line a part: the module that measures it, with a colon and an object's name where it has
# several, and a line of help.
PARTS = {
    "race": ("benchmarks.race.medians", "problems A and B, every contestant, medians"),
    "curve": ("benchmarks.race.curve", "accuracy against time of every contestant"),
    "states": ("benchmarks.speed.size:STATES", "a heated rod of 10 to 100 states"),
    "phases": ("benchmarks.speed.size:PHASES", "a run through gates in 2 to 20 phases"),
    "family": ("benchmarks.speed.family", "problem A for 100 jerk caps, each from the last"),
    "mpc": ("benchmarks.speed.mpc", "a cart-pole controlled by 100 solves of a prepared problem"),
    "imports": ("benchmarks.speed.imports", "processor time of starts and imports"),
    "instructions": (
        "benchmarks.speed.instructions",
        "instructions of A and B: solver, model, the rest",
    ),
}


@dataclass(frozen=True)
class Setup:
    """What was asked for.

    Attributes
    ----------
    console : Console
    repeats : int
        Runs of which a median is taken.
    limit : float
        Of one run [s].
    peers : bool
        Whether other tools take part.
    environments : Path
        Folder of their environments.
    """

    console: Console
    repeats: int
    limit: float
    peers: bool
    environments: Path


class BenchmarkPart(Protocol):
    """What the module of a part defines, or its object."""

    def measure(self, setup: Setup) -> Iterator[Measured]:
        """Measure, and hand out the record each time something was added to it."""

    def tables(self, record: Measured) -> list[Table]:
        """Return what is printed."""


def part(name: str) -> BenchmarkPart:
    """Return the module of a part; it is imported now, so that `--list` answers at once."""
    module, _, attribute = PARTS[name][0].partition(":")
    found = importlib.import_module(module)
    return cast(BenchmarkPart, getattr(found, attribute) if attribute else found)
