"""What is asked of a chain beside its motion.

`modes` finds the static equilibrium, natural frequencies and mode shapes. `lock` locks joints at
the end of a motion and says what energy the lock leaves in the chain.
"""

from models.ancf.analysis.lock import (
    Engagement,
    LockedRun,
    engage,
    latch_time,
    project,
    residual_energy,
    run_and_lock,
)
from models.ancf.analysis.modes import Modes, equilibrium, natural_modes

__all__ = [
    "Engagement",
    "LockedRun",
    "Modes",
    "engage",
    "equilibrium",
    "latch_time",
    "natural_modes",
    "project",
    "residual_energy",
    "run_and_lock",
]
