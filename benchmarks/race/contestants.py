"""Who takes part: our engine, two programs written by hand, and the peers that are asked for."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from benchmarks.processes import FreshProcess
from benchmarks.records import ROOT

PROBLEMS = ("A", "B")
ROWS = Path(__file__).parent / "rows"  # ours and by hand, and what every script imports
PEERS_FOLDER = Path(__file__).parent / "peers"


@dataclass(frozen=True)
class Contestant:
    """A tool with its statement of the two problems.

    Attributes
    ----------
    name : str
        File name of its script `run_NAME.py` and, for a peer, of its requirements `NAME.txt`.
    title : str
        As in the tables.
    sizes : mapping
        Of the mesh, for the curve of accuracy against time; what they mean is in the script.
    peer : bool
        Whether it lives in an environment of its own.
    """

    name: str
    title: str
    sizes: Mapping[str, tuple[int, ...]]
    peer: bool = False

    @property
    def requirements(self) -> Path:
        """File of a peer's pinned requirements."""
        return PEERS_FOLDER / f"{self.name}.txt"

    def process(self, python: Path | None = None) -> FreshProcess:
        """Return the script as a process, of our interpreter or of the peer's `python`.

        A peer sees what the scripts share and nothing else of ours.
        """
        if python is None:
            script = ROWS / f"run_{self.name}.py"
            return FreshProcess((sys.executable, str(script)), {"PYTHONPATH": str(ROOT)})
        script = PEERS_FOLDER / f"run_{self.name}.py"
        return FreshProcess((str(python), str(script)), {"PYTHONPATH": str(ROWS)})


def both(*sizes: int) -> Mapping[str, tuple[int, ...]]:
    """Return the same sizes for both problems."""
    return dict.fromkeys(PROBLEMS, sizes)


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
    Contestant("openscvx", "OpenSCvx 0.5.2", both(10, 20, 40, 110), peer=True),
    Contestant("pycollo", "pycollo 0.1.6", {"A": (50, 100, 200), "B": (20, 40, 80)}, peer=True),
)


def taking_part(peers: bool) -> tuple[Contestant, ...]:
    """Return the contestants, with the peers or without."""
    return (OURS, *BASELINES, *(PEERS if peers else ()))
