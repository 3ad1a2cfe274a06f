"""One law for many trusses: `run(RobustTrussStudy(...))` gives a `Result`."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from studies.robust.config import RobustTrussStudy, Uncertainty, study_from
    from studies.robust.study import run

_MODULES = {
    "RobustTrussStudy": "config",
    "Uncertainty": "config",
    "run": "study",
    "study_from": "config",
}

__all__ = ["RobustTrussStudy", "Uncertainty", "run", "study_from"]


def __getattr__(name: str) -> Any:
    """A public name, from the module that has it."""
    if name not in _MODULES:
        raise AttributeError(f"module 'studies.robust' has no attribute {name!r}")
    return getattr(import_module(f"studies.robust.{_MODULES[name]}"), name)
