"""Sweeps: one study of the truss, the arm or a chain, solved for many values of its keys.

`config` is what the user states, `subjects` what can be swept. `cases` plans the cases and keeps
one file of each; `workers` solves them in processes of their own; `driver` hands them out.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from studies.sweep.config import SweepStudy, study_from
    from studies.sweep.figures import draw

_MODULES = {"SweepStudy": "config", "study_from": "config", "draw": "figures"}

__all__ = ["SweepStudy", "draw", "study_from"]


def __getattr__(name: str) -> Any:
    """A public name, from the module that has it."""
    if name not in _MODULES:
        raise AttributeError(f"module 'studies.sweep' has no attribute {name!r}")
    return getattr(import_module(f"studies.sweep.{_MODULES[name]}"), name)
