"""Constraints that hold at all times of a phase: path bounds, signal bounds, peaks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ocp.problem.statement import Problem
from ocp.problem.symbols import is_number
from ocp.problem.terms import Functional
from ocp.transcription.scaling import Scales
from ocp.transcription.variables import PhaseLayout


@dataclass(frozen=True, eq=False)
class Continuous:
    """``lower <= sign * expression - peak <= upper`` at all times of a phase.

    Attributes
    ----------
    sampled : bool
        Whether the collocation points carry a row for it (bounds of signals are bounds of
        unknowns there).
    peak : Functional or None
        The peak that bounds the expression from above.
    """

    name: str
    unit: str
    expression: ca.SX
    lower: Any
    upper: Any
    scale: float
    sampled: bool
    peak: Functional | None = None
    sign: float = 1.0
    is_equation: bool = False


def continuous_constraints(
    problem: Problem, layout: PhaseLayout, scales: Scales
) -> tuple[Continuous, ...]:
    """All constraints of a phase in continuous time, rows of the collocation points first."""
    phase = layout.phase
    found = [
        Continuous(b.name, b.unit, b.expression, b.lower, b.upper,
                   scales.bounds[phase.name, b.name], True, is_equation=b.is_equation)
        for b in phase.bounds
    ]  # fmt: skip
    for f in problem.functionals:
        for name, expression in f.pieces if f.kind == "peak" else ():
            for sign in (1.0, -1.0) if f.absolute else (1.0,):
                if name == phase.name:
                    found.append(Continuous(
                        f.name, f.unit, expression, -math.inf, 0.0, scales.functionals[f], True,
                        f, sign))  # fmt: skip
    for signal in (*layout.states, *layout.algebraics):
        limits = (signal.lower, signal.upper)
        if not all(is_number(v) and math.isinf(v) for v in limits):
            found.append(Continuous(
                signal.name, signal.unit, signal.symbol, *limits, scales.signals[signal.name],
                False))  # fmt: skip
    return tuple(found)
