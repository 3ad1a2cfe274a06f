"""The optimal deployment of the ring truss, as a study: `run(TrussStudy(...))` gives a `Result`.

What is listed here is loaded when it is asked for, so that the command starts without the models.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from studies.truss.config import SolverOptions, TrussStudy, study_from
    from studies.truss.figures import draw
    from studies.truss.limits.caps import Caps
    from studies.truss.study import run

_MODULES = {
    "Caps": "limits.caps",
    "SolverOptions": "config",
    "TrussStudy": "config",
    "study_from": "config",
    "run": "study",
    "draw": "figures",
}

__all__ = [
    "Caps",
    "SolverOptions",
    "TrussStudy",
    "draw",
    "run",
    "study_from",
]


def __getattr__(name: str) -> Any:
    """A public name, from the module that has it."""
    if name not in _MODULES:
        raise AttributeError(f"module 'studies.truss' has no attribute {name!r}")
    return getattr(import_module(f"studies.truss.{_MODULES[name]}"), name)
