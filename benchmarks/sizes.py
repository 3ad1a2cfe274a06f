"""Sizes of the engine: lines, files, numbers, import circles, and the files that a solve enters.

python -m benchmarks.sizes
"""

from __future__ import annotations

import argparse
import ast
import importlib
import io
import pkgutil
import sys
import tokenize
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
from scipy.sparse.csgraph import connected_components

import ocp
from benchmarks.entry import answer_for
from ocp import Control, Phase, Problem, State, solve
from studies.common.console import Console, Table

ROOT = Path(__file__).resolve().parents[1]

# Rooms that no bare `solve` enters, or needs for its answer.
_BEHIND_THE_SOLVE = ("analysis", "diagnostics", "solution")

# Numbers that need no name.
_PLAIN = {0, 1, 2, 3, 0.5}


@dataclass(frozen=True)
class CountedFile:
    """A file of Python, counted.

    Attributes
    ----------
    path : Path
        Relative to the project.
    lines, code, docstrings : int
        All lines; those with code, without docstrings and comments; those of docstrings.
    numbers : int
        Literals other than 0, 1, 2, 3 and 1/2, with either sign.
    imports, for_types : frozenset of str
        Dotted names that it imports anywhere, and those of them that only a type checker follows.
    """

    path: Path
    lines: int
    code: int
    docstrings: int
    numbers: int
    imports: frozenset[str]
    for_types: frozenset[str]

    @property
    def module(self) -> str:
        parts = self.path.with_suffix("").parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def counted(path: Path) -> CountedFile:
    """Count a file."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    of_docstrings = {line for node in _docstrings(tree) for line in _span(node)}
    ignored = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT)
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    with_tokens = {
        line
        for token in tokens
        if token.type not in (*ignored, tokenize.ENDMARKER)
        for line in range(token.start[0], token.end[0] + 1)
    }
    return CountedFile(
        path.relative_to(ROOT),
        lines=text.count("\n"),
        code=len(with_tokens - of_docstrings),
        docstrings=len(of_docstrings),
        numbers=sum(_is_number(node) for node in ast.walk(tree)),
        imports=frozenset(_imports(tree)),
        for_types=frozenset(name for block in _for_types(tree) for name in _imports(block)),
    )


def _docstrings(tree: ast.AST) -> Iterator[ast.AST]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0] if node.body else None
            if isinstance(first, ast.Expr) and ast.get_docstring(node, clean=False) is not None:
                yield first


def _span(node: Any) -> range:
    return range(node.lineno, node.end_lineno + 1)


def _is_number(node: ast.AST) -> bool:
    if not isinstance(node, ast.Constant) or isinstance(node.value, bool):
        return False
    return isinstance(node.value, int | float) and node.value not in _PLAIN


def _imports(tree: ast.AST) -> Iterator[str]:
    """Names of imported modules, and of what is imported from them, which may be modules."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _for_types(tree: ast.AST) -> Iterator[ast.If]:
    """Blocks below `if TYPE_CHECKING`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            yield node


def circles(sources: Sequence[CountedFile], *, types: bool = False) -> list[list[str]]:
    """Modules that import each other, directly or by others: the strongly connected components.

    Parameters
    ----------
    types : bool
        Whether imports for types alone count.
    """
    places = {source.module: k for k, source in enumerate(sources)}
    links = np.zeros((len(sources), len(sources)), dtype=bool)
    for k, source in enumerate(sources):
        for name in source.imports - (set() if types else source.for_types):
            if (owner := _owner(name, places)) is not None:
                links[k, places[owner]] = True

    _, labels = connected_components(links, connection="strong")
    groups = ([m for m, k in places.items() if labels[k] == one] for one in np.unique(labels))
    return sorted(sorted(group) for group in groups if len(group) > 1)


def _owner(name: str, known: Container[str]) -> str | None:
    """The module that a name is, or is defined in; None outside the files that are known."""
    if name in known:
        return name
    parent = name.rpartition(".")[0]
    return parent if parent in known else None


def entered() -> set[str]:
    """Files of `ocp` in which functions run while the README's problem is solved."""
    for module in pkgutil.walk_packages(ocp.__path__, "ocp."):
        importlib.import_module(module.name)
    x, v = State("position", "m", upper=1 / 9), State("speed", "m/s")
    u = Control("thrust", "m/s^2")
    ride = Phase("ride", {x: v, v: u}, initial={x: 0, v: 1}, final={x: 0, v: -1}, end=1.0)
    problem, files = Problem("Bryson-Denham", [ride], minimise=ride.integral(u**2 / 2)), set[str]()

    def called(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            files.add(frame.f_code.co_filename)

    sys.setprofile(called)
    try:
        solve(problem)
    finally:
        sys.setprofile(None)
    return {name for name in files if f"{ROOT}/ocp/" in name}


def on_solve_path(source: CountedFile) -> bool:
    """Whether a bare `solve` needs a file: not those of analysis, solution and diagnostics."""
    return source.path.parts[1] not in _BEHIND_THE_SOLVE


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the sizes of `ocp`."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sizes", description=__doc__)
    return answer_for(parser, _print, arguments)


def _print(_: argparse.Namespace, console: Console) -> int:
    sources = [counted(path) for path in sorted((ROOT / "ocp").rglob("*.py"))]
    tests = [counted(path) for path in sorted((ROOT / "tests" / "ocp").rglob("*.py"))]
    lines = sum(s.lines for s in sources)
    found, with_types = circles(sources), circles(sources, types=True)
    on_path = sum(s.code for s in sources if on_solve_path(s))
    rows = [
        ("code lines of ocp", f"{sum(s.code for s in sources):,}"),
        ("of these on the path of a solve", f"{on_path:,}"),
        ("all lines of ocp", f"{lines:,}"),
        ("docstrings", f"{sum(s.docstrings for s in sources) / lines:.1%}"),
        ("files of ocp", f"{len(sources)}"),
        ("numbers other than 0, 1, 2, 3, 1/2", f"{sum(s.numbers for s in sources)}"),
        ("import circles (files in them)", f"{len(found)} ({sum(map(len, found))})"),
        ("with imports for types alone", f"{len(with_types)} ({sum(map(len, with_types))})"),
        ("lines of tests/ocp", f"{sum(s.lines for s in tests):,}"),
        ("files that the README's solve enters", f"{len(entered())}"),
    ]
    console.say(Table("Sizes of the engine", ("size", "value"), rows))
    for circle in with_types:
        console.say("circle: " + ", ".join(circle))
    return 0


if __name__ == "__main__":
    sys.exit(main())
