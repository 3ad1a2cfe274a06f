"""Mechanism and motion of the truss as one problem: `run(CodesignStudy(...))` gives a `Result`."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from studies.codesign.config import CodesignStudy, DesignSpace, study_from
    from studies.codesign.study import run

_MODULES = {
    "CodesignStudy": "config",
    "DesignSpace": "config",
    "study_from": "config",
    "run": "study",
}

__all__ = ["CodesignStudy", "DesignSpace", "run", "study_from"]


def __getattr__(name: str) -> Any:
    """A public name, from the module that has it."""
    if name not in _MODULES:
        raise AttributeError(f"module 'studies.codesign' has no attribute {name!r}")
    return getattr(import_module(f"studies.codesign.{_MODULES[name]}"), name)
