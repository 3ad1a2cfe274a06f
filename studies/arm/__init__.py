"""Motions of the supporting arm, as studies: `run(ArmStudy(...))` gives a `Result`.

What is listed here is loaded when it is asked for, so that the command starts without the models.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from studies.arm.config import (
        ArmDescription,
        ArmStudy,
        BaselinesStudy,
        LeastDurationStudy,
        RobustStudy,
        SequenceStudy,
        study_from,
    )
    from studies.arm.report.comparison_figures import draw
    from studies.arm.study import run
    from studies.arm.trade_off import TradeOffStudy

_MODULES = {
    "ArmDescription": "config",
    "ArmStudy": "config",
    "BaselinesStudy": "config",
    "LeastDurationStudy": "config",
    "RobustStudy": "config",
    "SequenceStudy": "config",
    "TradeOffStudy": "trade_off",
    "draw": "report.comparison_figures",
    "run": "study",
    "study_from": "config",
}

__all__ = [
    "ArmDescription",
    "ArmStudy",
    "BaselinesStudy",
    "LeastDurationStudy",
    "RobustStudy",
    "SequenceStudy",
    "TradeOffStudy",
    "draw",
    "run",
    "study_from",
]


def __getattr__(name: str) -> Any:
    """A public name, from the module that has it."""
    if name not in _MODULES:
        raise AttributeError(f"module 'studies.arm' has no attribute {name!r}")
    return getattr(import_module(f"studies.arm.{_MODULES[name]}"), name)
