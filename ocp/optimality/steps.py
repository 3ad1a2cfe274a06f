"""Steps along a motion: where dynamics, integrands or constraints jump as a comparison changes.

At such an instant the costates jump too, by an amount that depends on how the crossing moves
(Bryson and Ho, "Applied Optimal Control", 1975, section 3.7).  The nonlinear program has no
derivative that tells: where points move, they see the values of one side only.  Its solution holds
the dynamics, and need not be an optimum.  Two phases that meet where the comparison changes state
the same with derivatives.

How steps are found is in `ocp.numerics.step_search`, and smooth changes that are as steep in
`steep_search`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory, Trajectory
from ocp.numerics.steep_search import NO_WAY, SteepChange, may_be_steep, steep_changes
from ocp.numerics.step_search import FoundStep, SteppingExpressions
from ocp.problem.bounds import Bound
from ocp.problem.functionals import Integral, Peak, functional_text
from ocp.problem.problem import Problem
from ocp.problem.symbols import (
    TIME,
    Algebraic,
    Between,
    Constant,
    Control,
    Signal,
    State,
    Time,
    Unknown,
    resolve,
)
from ocp.problem.texts import text_of

_Owner = State | Bound | Integral | Peak

# Instants of an interval at which the motion is looked at
_INSTANTS = 8


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
        Whether its time depends on the motion. A step at a known time does not move, if a
        breakpoint stands there.
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
    """The steps along a motion, for each change of a comparison the largest, and steep changes."""
    for motion in trajectory.phases:
        stepwise = _steps_of(problem, motion.name, evaluator)
        if stepwise is not None:
            yield from stepwise.along(trajectory, motion, evaluator)


def may_step(problem: Problem, evaluator: Evaluator) -> bool:
    """Whether anything of a problem could step along a motion, steep changes left out."""
    found = (_steps_of(problem, phase.name, evaluator) for phase in problem.phases)
    return any(each is not None and each.stepping is not None for each in found)


def _steps_of(problem: Problem, phase: str, evaluator: Evaluator) -> _PhaseSteps | None:
    """What may step in a phase, found once."""
    return evaluator.once(("stepwise operations", phase), partial(_PhaseSteps.of, problem, phase))


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
    """The expressions of a phase that may step.

    Attributes
    ----------
    owners : tuple of State, Bound, Integral or Peak
        What the expressions belong to.
    expressions, symbols : tuple of SX
        They and what they depend on.
    stepping : SteppingExpressions or None
        Those of them that may step.
    steep : casadi.Function or None
        ``symbols -> expressions``, where they may change within next to no time.
    varying, jumping : SX (k,)
        Symbols that change along the phase, and those among them that may jump.
    timed : bool
        Whether a time of the phase is free.
    known : (k,)
        Known times of the phase, see `Problem.instants` [s].
    """

    owners: tuple[_Owner, ...]
    expressions: tuple[ca.SX, ...]
    symbols: tuple[ca.SX, ...]
    stepping: SteppingExpressions | None
    steep: ca.Function | None
    varying: ca.SX
    jumping: ca.SX
    timed: bool
    known: Array

    @classmethod
    def of(cls, problem: Problem, phase: str) -> _PhaseSteps | None:
        """Those of a phase, or None where it has none."""
        owned = list(path_expressions(problem, phase))
        expressions = tuple(expression for _, expression in owned)
        stepping, steep = SteppingExpressions.of(expressions), may_be_steep(expressions)
        if stepping is None and not steep:
            return None
        together = ca.densify(ca.vertcat(*expressions))
        symbols = tuple(ca.symvar(together))
        inputs = [ca.vertcat(*symbols, ca.SX(0, 1))]
        stated, signals = problem.phase(phase), problem.signals[phase]
        jumping = [s.symbol for s in signals if isinstance(s, (Control, Algebraic))]
        return cls(
            owners=tuple(owner for owner, _ in owned),
            expressions=expressions,
            symbols=symbols,
            stepping=stepping,
            steep=ca.Function("expressions", inputs, [together]) if steep else None,
            varying=ca.vertcat(TIME.symbol, *[s.symbol for s in signals]),
            jumping=ca.vertcat(*jumping, ca.SX(0, 1)),
            timed=isinstance(stated.start, Between) or isinstance(stated.end, Between),
            known=np.array(problem.instants[phase]),
        )

    def along(
        self, trajectory: Trajectory, motion: PhaseTrajectory, evaluator: Evaluator
    ) -> Iterator[ValueStep]:
        """Steps along the phase's motion."""

        def values(expressions: tuple[ca.SX, ...], times: Array) -> Array:
            return evaluator.values(trajectory, motion.name, expressions, *motion.locate(times))

        # off the ends of intervals: a motion that begins at rest has a speed of zero there, whose
        # sign is neither
        k = np.repeat(np.arange(motion.intervals), _INSTANTS)
        tau = np.tile((np.arange(_INSTANTS) + 0.5) / _INSTANTS, motion.intervals)
        times = motion.breakpoints[k] + tau * np.diff(motion.breakpoints)[k]
        places = np.concatenate([[motion.start], times, [motion.end]])

        def told(found: FoundStep | SteepChange, cause: ca.SX, condition: str) -> ValueStep:
            depends = resolve(cause, "a comparison")
            moves = self.timed and not self._is_held(motion, found.place)
            return ValueStep(
                phase=motion.name,
                time=found.place,
                condition=condition,
                expression=owner_text(self.owners[found.column]),
                size=found.size,
                unseen=any(
                    isinstance(s, (Signal, Unknown)) or (isinstance(s, Time) and moves)
                    for s in depends
                ),
                constants=frozenset(s.name for s in depends if isinstance(s, Constant)),
            )

        # what is not continuous may change at a breakpoint without a crossing
        jumps = self.jumping, np.concatenate([[False], np.diff(k) > 0, [False]])
        steps = list[float]()
        if self.stepping is not None:
            for found in self.stepping.along(places, values, self.varying, jumps):
                steps.append(found.place)
                yield told(found, found.cause, cause_text(found))
        if self.steep is not None:
            near = NO_WAY * (motion.end - motion.start)
            jumping = np.array([ca.depends_on(self.jumping, symbol) for symbol in self.symbols])
            own = np.array([ca.depends_on(TIME.symbol, symbol) for symbol in self.symbols])
            symbols = partial(values, self.symbols)
            for change in steep_changes(self.steep, symbols, places, jumping, own):
                if any(abs(change.place - place) <= near for place in steps):
                    continue
                expression = self.expressions[change.column]
                cause = TIME.symbol if change.by_place else expression
                yield told(change, cause, f"'{text_of(expression, 60)}' changes in next to no time")

    def _is_held(self, motion: PhaseTrajectory, place: float) -> bool:
        """Whether a breakpoint stands at a known time at a place of a motion [s]."""
        near = NO_WAY * (motion.end - motion.start)
        known = self.known[np.abs(self.known - place) <= near]
        return bool(np.isin(known, motion.breakpoints[1:-1]).any())


def cause_text(found: FoundStep) -> str:
    """What happens at a step, in words."""
    happens = "vanishes, by which it divides" if found.vanishes else "changes"
    return f"'{text_of(found.cause, 60)}' {happens}"


def path_expressions(problem: Problem, name: str) -> Iterator[tuple[_Owner, ca.SX]]:
    """All that holds along a phase, with what it belongs to."""
    phase = problem.phase(name)
    yield from phase.dynamics.items()
    for bound in phase.bounds:
        # what the limit of a size divides by is above zero by construction, but only a little
        if not (bound.of_cost and bound.scale):
            yield bound, bound.expression
    for functional in problem.functionals:
        if isinstance(functional, (Integral, Peak)):
            for where, expression in functional.pieces:
                if where == name:
                    yield functional, expression


def owner_text(owner: _Owner) -> str:
    """What an expression is, in words."""
    match owner:
        case Bound():
            return f"the bound '{owner.name}'"
        case Integral() | Peak():
            return f"the {functional_text(owner)}"
        case _:
            return f"the rate of '{owner.name}'"
