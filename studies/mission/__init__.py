"""Big arm, small arm and ring within one time budget: `run(MissionStudy(...))` gives a `Result`."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from studies.mission.config import MissionStudy, study_from
    from studies.mission.study import run

_MODULES = {"MissionStudy": "config", "study_from": "config", "run": "study"}

__all__ = ["MissionStudy", "run", "study_from"]


def __getattr__(name: str) -> Any:
    """A public name, from the module that has it."""
    if name not in _MODULES:
        raise AttributeError(f"module 'studies.mission' has no attribute {name!r}")
    return getattr(import_module(f"studies.mission.{_MODULES[name]}"), name)
