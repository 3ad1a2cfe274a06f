"""The parts of `python -m benchmarks.race`: their names, and what each is told and gives."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, cast

from studies.common.console import Console, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Measured = Mapping[str, Any]


class Listed(NamedTuple):
    """A part as `--list` shows it.

    Attributes
    ----------
    module : that measures it, with a colon and an object's name where it has several.
    line : of help.
    """

    module: str
    line: str


PARTS = {
    "race": Listed("benchmarks.race.medians", "problems A and B, every contestant, medians"),
    "curve": Listed("benchmarks.race.curve", "accuracy against time of every contestant"),
    "benchmarks": Listed(
        "benchmarks.speed.parts.optima", "a pass over the problems with known optima"
    ),
    "arm": Listed("benchmarks.speed.parts.arm", "the arm's stage of 86 s"),
    "build": Listed("benchmarks.speed.parts.build", "building a problem's nonlinear program"),
    "growth": Listed(
        "benchmarks.speed.parts.growth",
        "problem B on meshes of 100 to 20,000 intervals, memory included",
    ),
    "modules": Listed("benchmarks.speed.parts.modules", "problem B with 6 to 1000 modules"),
    "elements": Listed("benchmarks.speed.parts.elements", "a pendulum of 4 to 64 ANCF elements"),
    "states": Listed("benchmarks.speed.parts.size:STATES", "a heated rod of 10 to 100 states"),
    "phases": Listed("benchmarks.speed.parts.size:PHASES", "a run through gates in 2 to 20 phases"),
    "family": Listed(
        "benchmarks.speed.parts.family", "problem A for 100 jerk caps, each from the last"
    ),
    "mpc": Listed(
        "benchmarks.speed.parts.mpc", "a cart-pole controlled by 100 solves of a prepared problem"
    ),
    "imports": Listed("benchmarks.speed.parts.imports", "what loads, and how long it takes"),
    "instructions": Listed(
        "benchmarks.speed.parts.instructions", "instructions of A and B: solver, model, the rest"
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

    def draw(self, record: Measured) -> Figure | None:
        """Return the figure, if there is one."""


def part(name: str) -> BenchmarkPart:
    """Return the module of a part; it is imported now, so that `--list` answers at once."""
    module, _, attribute = PARTS[name].module.partition(":")
    found = importlib.import_module(module)
    return cast(BenchmarkPart, getattr(found, attribute) if attribute else found)
