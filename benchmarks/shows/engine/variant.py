"""Problems of the files in `problems/`: numbers drawn at random, expressions evaluated."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from types import CodeType
from typing import Any

import casadi as ca
import numpy as np

FOLDER = Path(__file__).with_name("problems")
FAMILIES = "families"

_FUNCTIONS: dict[str, Any] = {
    "sin": ca.sin,
    "cos": ca.cos,
    "exp": ca.exp,
    "log": ca.log,
    "sqrt": ca.sqrt,
    "atan": ca.atan,
    "pi": math.pi,
}


@lru_cache(maxsize=4096)
def _code(expression: str) -> CodeType:
    return compile(expression.strip(), "<expression>", "eval")


def evaluated(expression: Any, names: Mapping[str, Any]) -> Any:
    """An expression of the file, a number or a text, at values or symbols of its names."""
    if isinstance(expression, str):
        # the expressions are those of our own file; guesses are evaluated at thousands of times
        return eval(_code(expression), {"__builtins__": {}}, {**_FUNCTIONS, **names})
    return expression


def catalogue(file: str = FAMILIES) -> dict[str, Any]:
    """What a file says of each problem, by name."""
    return tomllib.loads((FOLDER / f"{file}.toml").read_text("utf-8"))


@dataclass(frozen=True, eq=False)
class Variant:
    """One problem with numbers.

    Attributes
    ----------
    name : str
    stated : mapping
        What the file says of it.
    numbers : mapping of str to float
        Values of what varies.
    samples : mapping of str to list of float
        Times and measured values of a fit, empty without one.
    """

    name: str
    stated: Mapping[str, Any]
    numbers: Mapping[str, float]
    samples: Mapping[str, Sequence[float]] = field(default_factory=dict)

    @classmethod
    def nominal(cls, name: str, file: str = FAMILIES) -> Variant:
        """The problem as it is known."""
        stated = catalogue(file)[name]
        numbers = {key: _number(entry[0]) for key, entry in stated.get("vary", {}).items()}
        samples = {k: v for k, v in stated.get("samples", {}).items() if k != "scatter"}
        return cls(name, stated, numbers, samples)

    @classmethod
    def drawn(cls, name: str, random: np.random.Generator) -> Variant:
        """A problem with numbers within their ranges."""
        stated = catalogue()[name]
        numbers = {}
        for key, (_, *ends) in stated["vary"].items():
            low, high = map(_number, ends)
            if low > 0:
                numbers[key] = math.exp(random.uniform(math.log(low), math.log(high)))
            else:
                numbers[key] = random.uniform(low, high)

        samples = dict(stated.get("samples", {}))
        scatter = samples.pop("scatter", 0.0)
        for key in samples.keys() - {"times"}:
            values = np.array(samples[key])
            noise = random.uniform(1.0 - scatter, 1.0 + scatter, values.size)
            samples[key] = (values * noise).tolist()
        return cls(name, stated, {k: float(f"{v:.6g}") for k, v in numbers.items()}, samples)

    @property
    def phases(self) -> Sequence[Mapping[str, Any]]:
        """What the file says of each phase."""
        phases: Sequence[Mapping[str, Any]] = self.stated["phases"]
        return phases

    @property
    def proven_without_motion(self) -> bool:
        """Whether it is proven that no motion exists."""
        return bool(self.value(self.stated.get("none_if", -1.0)) > 0)

    def value(self, expression: Any, **more: float) -> float:
        """The number that an expression of what varies stands for."""
        return float(evaluated(expression, {**self.numbers, **more}))

    def limits(self, entry: Mapping[str, Any]) -> tuple[float, float]:
        """Lower and upper limit of a signal, an unknown or a row."""
        return self.value(entry.get("lower", -math.inf)), self.value(entry.get("upper", math.inf))

    def times(self, phase: Mapping[str, Any], end: str) -> tuple[float, float, float]:
        """Lower limit, upper limit and guess of the first or last time of a phase [s]."""
        entry = phase.get(end, 0.0)
        if isinstance(entry, list):
            lower, upper, guess = map(self.value, entry)
            return lower, upper, guess
        fixed = self.value(entry)
        return fixed, fixed, fixed

    def guess(self, signal: Mapping[str, Any], s: Any) -> Any:
        """The crude guess of a signal at a fraction of its phase, or at several."""
        if "guess" in signal:
            return evaluated(signal["guess"], {**self.numbers, "s": s})
        first = self.value(signal.get("first", signal.get("last", 0.0)))
        return first + s * (self.value(signal.get("last", first)) - first)

    def at_ends(self, values: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
        """Names of boundary values as the objective has them; `values` by phase, then by name."""
        names: dict[str, Any] = dict(self.numbers)
        for phase, own in values.items():
            prefix = "" if len(self.phases) == 1 else f"{phase}_"
            names |= {prefix + key: value for key, value in own.items()}
        return names


def _number(entry: Any) -> float:
    return float(evaluated(entry, {}))
