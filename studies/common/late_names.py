"""Public names of a package that are loaded when they are asked for.

So that a command starts without models and solvers, the face of a study imports nothing: its
imports stand below `if TYPE_CHECKING:`, where type checkers read them, and this function does.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def late_names(package: str, file: str) -> Callable[[str], Any]:
    """The `__getattr__` of a package.

    Parameters
    ----------
    package, file : str
        Its `__name__` and `__file__`.
    """
    modules: dict[str, str] = {}

    def found(name: str) -> Any:
        if not modules:
            face = ast.parse(Path(file).read_text("utf-8"))
            late = [line for block in face.body if isinstance(block, ast.If) for line in block.body]
            for node in late:
                if isinstance(node, ast.ImportFrom):
                    modules.update(dict.fromkeys((a.name for a in node.names), f"{node.module}"))
        if name not in modules:
            raise AttributeError(f"module '{package}' has no attribute {name!r}")
        return getattr(import_module(modules[name]), name)

    return found
