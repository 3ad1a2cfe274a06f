"""Who takes part: our engine, two programs written by hand, and the peers that are asked for."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import studies
from studies.speed.fresh import Program

ROWS = Path(__file__).parent / "rows"


@dataclass(frozen=True)
class Contestant:
    """A tool with its statement of the two problems.

    Attributes
    ----------
    name : file name of its script and, for a peer, of its requirements.
    title : as in the tables.
    sizes : of the mesh, for the curve of accuracy against time; what they mean is in the script.
    peer : whether it lives in an environment of its own.
    """

    name: str
    title: str
    sizes: Mapping[str, tuple[int, ...]]
    peer: bool = False

    @property
    def requirements(self) -> Path:
        """File of pinned requirements."""
        return ROWS / f"{self.name}.txt"

    def program(self, python: Path | None = None) -> Program:
        """The script, run by our interpreter or the peer's."""
        ours = {"PYTHONPATH": str(Path(studies.__file__).parents[1])}
        script = str(ROWS / f"run_{self.name}.py")
        if python is None:
            return Program((sys.executable, script), ours)
        return Program((str(python), script), {"PYTHONPATH": None})


def both(*sizes: int) -> Mapping[str, tuple[int, ...]]:
    """The same sizes for both problems."""
    return {"A": sizes, "B": sizes}


OURS = Contestant("ours", "antenna-ocp", both(3, 4, 5, 6))
BASELINES = (
    Contestant("breakpoints", "by hand, moving breakpoints", {"A": (5,), "B": (6, 8, 12, 16, 24)}),
    Contestant("uniform", "by hand, map, uniform mesh", both(28, 56, 110, 210, 420, 840)),
)
PEERS = (
    Contestant("rockit", "rockit 0.6.7", both(28, 56, 110, 210, 420), peer=True),
    Contestant("yapss", "yapss 0.2.3", both(56, 100, 130, 204, 400), peer=True),
    Contestant("dompc", "do-mpc 5.1.1", both(28, 56, 110, 210, 420), peer=True),
    Contestant("dymos", "dymos 1.15.0 (SLSQP)", both(8, 12, 20), peer=True),
    Contestant("mpopt", "mpopt 0.2.1", {"A": (300, 800, 2500), "B": (50, 100, 200)}, peer=True),
    Contestant("pycollo", "pycollo 0.1.6", {"A": (50, 100, 200), "B": (20, 40, 80)}, peer=True),
)
