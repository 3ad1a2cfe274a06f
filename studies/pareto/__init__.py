"""Trade-offs as studies: `run(ParetoStudy(...))` gives a `Result` whose axis is the front.

What is listed here is loaded when it is asked for, so that the command starts without the models.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from studies.pareto.config import ParetoStudy, pareto_from
    from studies.pareto.figures import draw
    from studies.pareto.study import run

_MODULES = {
    "ParetoStudy": "config",
    "draw": "figures",
    "pareto_from": "config",
    "run": "study",
}

__all__ = ["ParetoStudy", "draw", "pareto_from", "run"]


def __getattr__(name: str) -> Any:
    """A public name, from the module that has it."""
    if name not in _MODULES:
        raise AttributeError(f"module 'studies.pareto' has no attribute {name!r}")
    return getattr(import_module(f"studies.pareto.{_MODULES[name]}"), name)
