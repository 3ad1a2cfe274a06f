"""Steps along a motion: where dynamics, integrands or constraints jump as a comparison changes.

At such an instant the costates jump too, by an amount that depends on how the crossing moves
(Bryson and Ho, "Applied Optimal Control", 1975, section 3.7).  The nonlinear program has no
derivative that tells: where points move, they see the values of one side only.  Its solution holds
the dynamics, and need not be an optimum.  Two phases that meet where the comparison changes state
the same with derivatives.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory, Trajectory
from ocp.numerics.columnwise import columnwise
from ocp.numerics.stepwise_operations import StepwiseOperations, stepwise_operations
from ocp.problem.bounds import Bound
from ocp.problem.display import functional_text, text_of
from ocp.problem.functionals import Integral, Peak
from ocp.problem.problem import Problem
from ocp.problem.symbols import (
    Algebraic,
    Between,
    Constant,
    Control,
    Signal,
    State,
    Symbol,
    Time,
    Unknown,
    resolve,
)

_Owner = State | Bound | Integral | Peak

# Instants of an interval at which the comparisons are looked at, off its ends: there a motion that
# begins at rest has a speed of zero, whose sign is neither.
_INSTANTS = 8

# Halvings of the time between two such instants, to rounding
_HALVINGS = 50

# Part of the phase by which the sides of a step are apart: comparisons that are meant to change
# together differ by rounding.
_BESIDE = 1e-9

# A step of less than this part of the largest value along the motion is none.
_LEAST_STEP = 1e-6


@dataclass(frozen=True)
class ValueStep:
    """A step of an expression along a motion.

    Attributes
    ----------
    phase : str
    time : float
        [s]
    condition, expression : str
        What changes there, such as ``speed < 2``, and what steps, in words.
    size : float
        Relative to the largest value of the expression along the motion.
    unseen : bool
        Whether its time depends on the motion. A step at a known time of a phase whose times are
        fixed does not move.
    constants : frozenset of str
        Names of the constants that its place depends on.
    """

    phase: str
    time: float
    condition: str
    expression: str
    size: float
    unseen: bool
    constants: frozenset[str]


def steps_along(
    problem: Problem, trajectory: Trajectory, evaluator: Evaluator
) -> Iterator[ValueStep]:
    """The steps along a motion, for each change of a comparison the largest."""
    for motion in trajectory.phases:
        key = ("stepwise operations", motion.name)
        if key not in evaluator.compiled:
            evaluator.compiled[key] = _PhaseSteps.of(problem, motion.name)
        stepwise: _PhaseSteps | None = evaluator.compiled[key]
        if stepwise is not None:
            yield from stepwise.along(trajectory, motion, evaluator)


def step_remark(steps: Iterable[ValueStep]) -> str:
    """What to say of steps that no derivative sees, or nothing where there are none."""
    unseen = [step for step in steps if step.unseen]
    if not unseen:
        return ""
    worst = max(unseen, key=lambda step: step.size)
    return (
        f"{worst.expression} in phase '{worst.phase}' steps at {worst.time:.6g} s, where "
        f"'{worst.condition}' changes, which no derivative shows: the answer need not be an "
        "optimum; split the phase there, and link the parts by joined(first, second)"
    )


@dataclass(frozen=True, eq=False, repr=False)
class _PhaseSteps:
    """The stepwise operations of a phase.

    Attributes
    ----------
    owners : tuple of State, Bound, Integral or Peak
        What the expressions belong to.
    symbols : tuple of SX
        Inputs of the operations' function.
    depends : tuple of tuple of Symbol
        What the result of each operation depends on.
    timed : bool
        Whether a time of the phase is free.
    """

    owners: tuple[_Owner, ...]
    symbols: tuple[ca.SX, ...]
    operations: StepwiseOperations
    depends: tuple[tuple[Symbol, ...], ...]
    timed: bool

    @classmethod
    def of(cls, problem: Problem, phase: str) -> _PhaseSteps | None:
        """Those of a phase, or None where it has none."""
        owned = list(_expressions(problem, phase))
        expressions = [expression for _, expression in owned]
        symbols = tuple(ca.symvar(ca.vertcat(*expressions)))
        operations = stepwise_operations(expressions, symbols)
        if operations is None:
            return None
        stated = problem.phase(phase)
        return cls(
            owners=tuple(owner for owner, _ in owned),
            symbols=symbols,
            operations=operations,
            depends=tuple(resolve(result, "a comparison") for result in operations.results),
            timed=isinstance(stated.start, Between) or isinstance(stated.end, Between),
        )

    def along(
        self, trajectory: Trajectory, motion: PhaseTrajectory, evaluator: Evaluator
    ) -> Iterator[ValueStep]:
        """Steps along the phase's motion."""

        def values(expressions: tuple[ca.SX, ...], times: Array) -> Array:
            return evaluator.values(trajectory, motion.name, expressions, *motion.locate(times))

        k = np.repeat(np.arange(motion.intervals), _INSTANTS)
        tau = np.tile((np.arange(_INSTANTS) + 0.5) / _INSTANTS, motion.intervals)
        times = motion.breakpoints[k] + tau * np.diff(motion.breakpoints)[k]
        results = values(self.operations.results, times)
        sizes = np.abs(self._held(values(self.symbols, times), results)).max(axis=0)

        # what is not continuous may change at a breakpoint without a crossing
        changed = np.diff(results, axis=0) != 0
        for number, symbols in enumerate(self.depends):
            if any(isinstance(symbol, (Control, Algebraic)) for symbol in symbols):
                changed[np.diff(k) > 0, number] = False
        places, numbers = np.nonzero(changed)
        if not places.size:
            return

        # each change is enclosed by halving
        low, high, before = times[places], times[places + 1], results[places, numbers]
        rows = np.arange(places.size)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            same = values(self.operations.results, middle)[rows, numbers] == before
            low, high = np.where(same, middle, low), np.where(same, high, middle)

        # with the signals of one instant and the results of both sides, what differs is the step
        beside = _BESIDE * (motion.end - motion.start)
        at = values(self.symbols, low)
        left, right = (
            self._held(at, values(self.operations.results, side))
            for side in (low - beside, high + beside)
        )
        relative = np.abs(right - left) / np.where(sizes > 0, sizes, 1.0)
        for time, which, parts in zip(high, numbers.tolist(), relative, strict=True):
            column = int(np.argmax(parts))
            if parts[column] > _LEAST_STEP:
                yield ValueStep(
                    phase=motion.name,
                    time=float(time),
                    condition=text_of(self.operations.results[which], 60),
                    expression=_name(self.owners[column]),
                    size=float(parts[column]),
                    unseen=self._moves(which),
                    constants=frozenset(
                        s.name for s in self.depends[which] if isinstance(s, Constant)
                    ),
                )

    def _moves(self, number: int) -> bool:
        """Whether the time at which a result changes depends on the motion."""
        return any(
            isinstance(symbol, (Signal, Unknown)) or (isinstance(symbol, Time) and self.timed)
            for symbol in self.depends[number]
        )

    def _held(self, symbols: Array, results: Array) -> Array:
        """The expressions at given symbols (m, n) and results (m, r)."""
        return columnwise(self.operations.function, symbols, results)[0]


def _expressions(problem: Problem, name: str) -> Iterator[tuple[_Owner, ca.SX]]:
    """All that holds along a phase, with what it belongs to."""
    phase = problem.phase(name)
    yield from phase.dynamics.items()
    for bound in phase.bounds:
        yield bound, bound.expression
    for functional in problem.functionals:
        if isinstance(functional, (Integral, Peak)):
            for where, expression in functional.pieces:
                if where == name:
                    yield functional, expression


def _name(owner: _Owner) -> str:
    """What an expression is, in words."""
    match owner:
        case Bound():
            return f"the bound '{owner.name}'"
        case Integral() | Peak():
            return f"the {functional_text(owner)}"
        case _:
            return f"the rate of '{owner.name}'"
