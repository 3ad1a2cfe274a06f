"""The passes of every solve, unless its settings name others."""

from __future__ import annotations

from ocp.reformulate.kinked_costs import KinkedCosts, KinkedNumbers
from ocp.reformulate.reformulation import Reformulation
from ocp.reformulate.split_controls import SplitControls

STANDARD_REFORMULATIONS: tuple[Reformulation, ...] = (
    KinkedNumbers(),
    SplitControls(),
    KinkedCosts(),
)
