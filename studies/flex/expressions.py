"""Laws as text, such as `0.5*sin(2*pi*t)`: read into CasADi, never run as Python.

The text is parsed by `ast`, and only what stands in the tables below is turned into an expression:
arithmetic, numbers, the names `t` and `T`, `pi`, and functions of a list. All else is refused.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array
from studies.common.configuration import closest, nearest
from studies.common.exit_codes import StudyError, quoted

LONGEST = 1000  # characters; a longer law belongs into a CSV file
DEEPEST = 60  # brackets within brackets


def _step(x: Any) -> Any:
    return ca.if_else(x >= 0, 1.0, 0.0)


def _smooth(x: Any) -> Any:
    s = ca.fmin(ca.fmax(x, 0.0), 1.0)
    return s**3 * (10 + s * (6 * s - 15))


# name: (number of arguments, function)
FUNCTIONS: Mapping[str, tuple[int, Callable[..., Any]]] = {
    "sin": (1, ca.sin),
    "cos": (1, ca.cos),
    "tan": (1, ca.tan),
    "asin": (1, ca.asin),
    "acos": (1, ca.acos),
    "atan": (1, ca.atan),
    "sinh": (1, ca.sinh),
    "cosh": (1, ca.cosh),
    "tanh": (1, ca.tanh),
    "exp": (1, ca.exp),
    "log": (1, ca.log),
    "sqrt": (1, ca.sqrt),
    "abs": (1, ca.fabs),
    "min": (2, ca.fmin),
    "max": (2, ca.fmax),
    "step": (1, _step),  # 0 below 0, 1 from there on
    "smooth": (1, _smooth),  # the quintic step of (39), 0 below 0 and 1 above 1
}
OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
    ast.USub: lambda a: -a,
    ast.UAdd: lambda a: a,
}
NAMES = ("t", "T", "pi")
_SHOWN = {ast.Attribute: "a dot", ast.Subscript: "an index", ast.Lambda: "lambda"}


@dataclass(frozen=True, eq=False)
class TimeLaw:
    """A law of the time with its exact first and second derivative.

    Attributes
    ----------
    text : as it was given.
    kernel : times (1, m) [s] to value, rate and acceleration, (1, m) each.
    """

    text: str
    kernel: Any

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Value and its two derivatives at times (m,)."""
        rows = self.kernel(np.atleast_1d(t)[None, :])
        value, rate, acceleration = (row.full().ravel() for row in rows)
        return value, rate, acceleration


def read_law(name: str, text: Any, duration: float) -> TimeLaw:
    """The law that a text states.

    Parameters
    ----------
    name : of its key, for the sentences.
    text : str
        In `t` [s]; `T` is the duration [s].
    duration : float
        [s]

    Raises
    ------
    StudyError
        If the text is no expression, or uses what is not in the lists above.
    """
    if not isinstance(text, str) or not text.strip():
        raise StudyError(
            f'{name} is {quoted(text)}; give an expression in t, such as "0.5*sin(pi*t)"'
        )
    if len(text) > LONGEST:
        raise StudyError(
            f"{name} has {len(text)} characters; give at most {LONGEST}, or the law as a CSV file"
        )

    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise StudyError(
            f"{name} is {quoted(text)}, which is not an expression in t ({error})"
        ) from error
    t = ca.SX.sym("t")
    names = {"t": t, "T": ca.SX(duration), "pi": ca.SX(math.pi)}
    value = _Translator(name, names).read(tree, 0)
    rate = ca.jacobian(value, t)
    kernel = ca.Function("law", [t], [value, rate, ca.jacobian(rate, t)])
    return TimeLaw(text.strip(), kernel)


class _Translator:
    """Turns the nodes of a syntax tree into expressions."""

    def __init__(self, name: str, names: Mapping[str, Any]) -> None:
        self.name, self.names = name, names

    def read(self, node: ast.AST, depth: int) -> Any:
        """The expression of one node."""
        if depth > DEEPEST:
            raise StudyError(f"{self.name} has more than {DEEPEST} nested levels; simplify it")
        if isinstance(node, ast.Constant):
            return self._number(node)
        if isinstance(node, ast.Name):
            return self._named(node)
        if isinstance(node, ast.Call):
            return self._call(node, depth)
        if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            sides = self.read(node.left, depth + 1), self.read(node.right, depth + 1)
            return OPERATORS[type(node.op)](*sides)
        if isinstance(node, ast.UnaryOp) and type(node.op) in OPERATORS:
            return OPERATORS[type(node.op)](self.read(node.operand, depth + 1))
        what = _SHOWN.get(type(node), f"'{ast.unparse(node)}'")
        raise StudyError(
            f"{self.name} uses {what}, which is not allowed in a law; use + - * / **, numbers, "
            f"{', '.join(NAMES)} and {', '.join(FUNCTIONS)}"
        )

    def _number(self, node: ast.Constant) -> Any:
        if isinstance(node.value, bool) or not isinstance(node.value, int | float):
            raise StudyError(
                f"{self.name} has {quoted(node.value)}, which is not a number; remove it"
            )
        # floats: a whole number to the power of another one could fill the memory
        try:
            return ca.SX(float(node.value))
        except OverflowError as error:
            raise StudyError(
                f"{self.name} has a number beyond 1e308; give a smaller one"
            ) from error

    def _named(self, node: ast.Name) -> Any:
        if node.id in self.names:
            return self.names[node.id]
        near = nearest(node.id, (*NAMES, *FUNCTIONS))
        hint = f"did you mean {near}?" if near else f"the known names are {', '.join(NAMES)}"
        raise StudyError(f"{self.name} has the unknown name '{node.id}'; {hint}")

    def _call(self, node: ast.Call, depth: int) -> Any:
        called = node.func.id if isinstance(node.func, ast.Name) else ""
        if called not in FUNCTIONS:
            hint = closest(called, FUNCTIONS, "the known functions are")
            shown = called or ast.unparse(node.func)
            raise StudyError(f"{self.name} calls '{shown}', which is not allowed in a law; {hint}")
        count, function = FUNCTIONS[called]
        if len(node.args) != count or node.keywords:
            raise StudyError(f"{self.name}: {called} takes {count} argument(s), without names")
        return function(*(self.read(argument, depth + 1) for argument in node.args))
