"""Steps along a motion: where dynamics, integrands or constraints jump as a comparison changes.

At such an instant the costates jump too, by an amount that depends on how the crossing moves
(Bryson and Ho, "Applied Optimal Control", 1975, section 3.7).  The nonlinear program has no
derivative that tells: where points move, they see the values of one side only.  Its solution holds
the dynamics, and need not be an optimum.  Two phases that meet where the comparison changes state
the same with derivatives.

A quotient may step where its divisor vanishes, see `ocp.optimality.quotient_steps`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory, Trajectory
from ocp.numerics.columnwise import columnwise
from ocp.numerics.divisors import divisors
from ocp.numerics.stepwise_operations import StepwiseOperations, stepwise_operations
from ocp.optimality.quotient_steps import LEAST_STEP, Values, instants_of, quotient_steps
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

# Halvings of the time between two such instants, to rounding
_HALVINGS = 50

# Part of the phase by which the sides of a step are apart: comparisons that are meant to change
# together differ by rounding.
_BESIDE = 1e-9


@dataclass(frozen=True)
class ValueStep:
    """A step of an expression along a motion.

    Attributes
    ----------
    phase : str
    time : float
        [s]
    condition, expression : str
        What happens there, such as ``'speed < 2' changes``, and what steps, in words.
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
        f"{worst.condition}, which no derivative shows: the answer need not be an optimum; split "
        "the phase there, and link the parts by joined(first, second)"
    )


@dataclass(frozen=True, eq=False, repr=False)
class _PhaseSteps:
    """The stepwise operations and the divisors of a phase.

    Attributes
    ----------
    owners : tuple of State, Bound, Integral or Peak
        What the expressions belong to.
    expressions, symbols : tuple of SX
        They and what they depend on, the inputs of the operations' function.
    operations : StepwiseOperations or None
    depends : tuple of tuple of Symbol
        What the result of each operation depends on.
    divisors : tuple of SX
        That may vanish along the phase.
    timed : bool
        Whether a time of the phase is free.
    """

    owners: tuple[_Owner, ...]
    expressions: tuple[ca.SX, ...]
    symbols: tuple[ca.SX, ...]
    operations: StepwiseOperations | None
    depends: tuple[tuple[Symbol, ...], ...]
    divisors: tuple[ca.SX, ...]
    timed: bool

    @classmethod
    def of(cls, problem: Problem, phase: str) -> _PhaseSteps | None:
        """Those of a phase, or None where it has none."""
        owned = list(_expressions(problem, phase))
        expressions = tuple(expression for _, expression in owned)
        symbols = tuple(ca.symvar(ca.vertcat(*expressions)))
        operations = stepwise_operations(expressions, symbols)
        varying = tuple(
            divisor
            for divisor in divisors(expressions, symbols)
            if any(isinstance(s, (Signal, Time)) for s in resolve(divisor, "a divisor"))
        )
        if operations is None and not varying:
            return None
        results = operations.results if operations is not None else ()
        stated = problem.phase(phase)
        return cls(
            owners=tuple(owner for owner, _ in owned),
            expressions=expressions,
            symbols=symbols,
            operations=operations,
            depends=tuple(resolve(result, "a comparison") for result in results),
            divisors=varying,
            timed=isinstance(stated.start, Between) or isinstance(stated.end, Between),
        )

    def along(
        self, trajectory: Trajectory, motion: PhaseTrajectory, evaluator: Evaluator
    ) -> Iterator[ValueStep]:
        """Steps along the phase's motion."""

        def values(expressions: tuple[ca.SX, ...], times: Array) -> Array:
            return evaluator.values(trajectory, motion.name, expressions, *motion.locate(times))

        if self.operations is not None:
            yield from self._changes(self.operations, motion, values)
        if self.divisors:
            symbols = self.expressions, self.symbols
            for zero in quotient_steps(self.divisors, *symbols, motion, values):
                condition = f"'{text_of(zero.divisor, 60)}' vanishes, by which it divides"
                of = resolve(zero.divisor, "a divisor")
                yield self._step(motion, zero.time, condition, of, zero.column, zero.size)

    def _changes(
        self, operations: StepwiseOperations, motion: PhaseTrajectory, values: Values
    ) -> Iterator[ValueStep]:
        """Steps where the result of an operation changes."""
        function = operations.function
        k, times = instants_of(motion)
        results = values(operations.results, times)
        sizes = np.abs(_held(function, values(self.symbols, times), results)).max(axis=0)

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
            same = values(operations.results, middle)[rows, numbers] == before
            low, high = np.where(same, middle, low), np.where(same, high, middle)

        # with the signals of one instant and the results of both sides, what differs is the step
        beside = _BESIDE * (motion.end - motion.start)
        at = values(self.symbols, low)
        left, right = (
            _held(function, at, values(operations.results, side))
            for side in (low - beside, high + beside)
        )
        relative = np.abs(right - left) / np.where(sizes > 0, sizes, 1.0)
        for time, which, parts in zip(high, numbers.tolist(), relative, strict=True):
            column = int(np.argmax(parts))
            if parts[column] > LEAST_STEP:
                condition = f"'{text_of(operations.results[which], 60)}' changes"
                of = self.depends[which]
                yield self._step(motion, float(time), condition, of, column, float(parts[column]))

    def _step(
        self,
        motion: PhaseTrajectory,
        time: float,
        condition: str,
        depends: tuple[Symbol, ...],
        column: int,
        size: float,
    ) -> ValueStep:
        """The step of an expression at a time that depends on some symbols."""
        unseen = any(
            isinstance(symbol, (Signal, Unknown)) or (isinstance(symbol, Time) and self.timed)
            for symbol in depends
        )
        return ValueStep(
            phase=motion.name,
            time=time,
            condition=condition,
            expression=_name(self.owners[column]),
            size=size,
            unseen=unseen,
            constants=frozenset(s.name for s in depends if isinstance(s, Constant)),
        )


def _held(function: ca.Function, symbols: Array, results: Array) -> Array:
    """The expressions at given symbols (m, n) and results of stepwise operations (m, r)."""
    return columnwise(function, symbols, results)[0]


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
