"""Steps beside a motion: what jumps as a number of the whole motion changes.

A parameter, an end value or a time is one number. An objective such as ``floor(x at the end)``, or
a rate that depends on ``sign(parameter)``, steps where that number passes a value. The nonlinear
program sees a slope of zero on both sides. Its solution is the best on its own side, and nothing
shows what the other side has. So each number is moved over its range, and what steps is told.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory
from ocp.numerics.columnwise import columnwise
from ocp.numerics.step_search import SteppingExpressions
from ocp.optimality.iterate import Iterate
from ocp.optimality.steps import cause_text, owner_text, path_expressions
from ocp.problem.display import with_unit
from ocp.problem.functionals import BoundaryValue, Functional, PhaseTime, PointValue
from ocp.problem.parameters import Interval
from ocp.problem.symbols import Between, Constant, Signal, Symbol, Time, Unknown, resolve
from ocp.problem.texts import text_of

# Values of a number that are looked at, and instants of a phase at which a parameter is moved
_VALUES = 65
_INSTANTS = 5

# Sizes of a number up to which it is moved where nothing limits it. Its size is often that of where
# a motion starts, and the motion may end at a multiple of that.
_FAR = 10.0

# Part of its size that is rounding of a number
_ZERO = 1e-12

_ANY = (-math.inf, math.inf)


@dataclass(frozen=True)
class NumberStep:
    """A step of an expression at a value of a number of the whole motion.

    Attributes
    ----------
    expression, condition : str
        What steps, and what happens there, such as ``'sign(p)' changes``, in words.
    number, unit : str
    place, own : float
        Where it steps, and its value now [unit].
    size : float
        Relative to the largest value of the expression in the range of the number.
    away : float
        From its own value to the place, in sizes of the number.
    """

    expression: str
    condition: str
    number: str
    unit: str
    place: float
    own: float
    size: float
    away: float


def number_steps(iterate: Iterate, evaluator: Evaluator) -> Iterator[NumberStep]:
    """Steps of the objective, of constraints and of rates as parameters and end values change."""
    yield from _of_the_problem(iterate, evaluator)
    for functional in iterate.problem.functionals:
        if isinstance(functional, (BoundaryValue, PointValue)):
            yield from _of_a_value(iterate, evaluator, functional)
    unknowns = ca.vertcat(*[unknown.symbol for unknown in iterate.problem.unknowns], ca.SX(0, 1))
    for phase in iterate.problem.phases:
        # the expressions of a phase are long, and most depend on no unknown
        along = [expression for _, expression in path_expressions(iterate.problem, phase.name)]
        if ca.depends_on(ca.vertcat(*along), unknowns):
            yield from _of_a_phase(iterate, evaluator, phase.name)


def nearest_step(iterate: Iterate, evaluator: Evaluator, limits: Mapping[str, Interval]) -> str:
    """Where something steps near a motion by which less of a limit might do; empty if nothing does.

    Rates, constraints and integrands count as a signal changes by itself, too, though the motion
    does not cross the step.

    Parameters
    ----------
    limits : mapping of str to (lower, upper)
        Of the signals by name.
    """
    found = list(number_steps(iterate, evaluator))
    for phase in iterate.problem.phases:
        found += _of_a_phase(iterate, evaluator, phase.name, limits)
    if not found:
        return ""
    nearest = min(found, key=lambda step: step.away)
    return (
        f"{_where(nearest)}, which no derivative shows: on the other side less may be needed, or "
        "nothing; try it with limits that keep to it"
    )


def _where(step: NumberStep) -> str:
    """Where an expression steps, in words."""
    at = with_unit(f"{step.number} = {step.place:.6g}", step.unit)
    return f"{step.expression} steps at {at} (now {step.own:.6g}), where {step.condition}"


def number_remark(steps: Iterable[NumberStep]) -> str:
    """What to say of steps beside a motion, or nothing where there are none."""
    nearest = min(steps, key=lambda step: step.away, default=None)
    if nearest is None:
        return ""
    return (
        f"{_where(nearest)}, which no derivative shows: the answer may be the best on its own side "
        "of that value only; solve for each side alone, with limits that keep to it, and take the "
        "better"
    )


@dataclass(frozen=True, eq=False, repr=False)
class _Lines:
    """Expressions of some symbols, each of which is moved alone.

    Attributes
    ----------
    owners : tuple of str
        What the expressions belong to.
    symbols : tuple of Symbol
        In the order of those of `stepping`.
    functions : dict
        What was compiled, by the expressions.
    """

    owners: tuple[str, ...]
    stepping: SteppingExpressions
    symbols: tuple[Symbol, ...]
    functions: dict[tuple[int, ...], ca.Function]

    @classmethod
    def of(cls, owned: Sequence[tuple[str, ca.SX]]) -> _Lines | None:
        """Those of expressions, or None where none of them may step."""
        if not owned or not ca.symvar(ca.vertcat(*[e for _, e in owned])):
            return None
        stepping = SteppingExpressions.of(tuple(expression for _, expression in owned))
        if stepping is None:
            return None
        symbols = tuple(resolve(each, "an expression")[0] for each in stepping.symbols)
        return cls(tuple(owner for owner, _ in owned), stepping, symbols, {})

    def along(
        self, own: Array, moved: Sequence[tuple[int, Interval, float]], alone: bool = False
    ) -> Iterator[NumberStep]:
        """Steps on lines through the symbols' own values (n,).

        Parameters
        ----------
        moved : sequence of (int, (lower, upper), size)
            Numbers of the symbols that are moved, their limits and typical sizes.
        alone : bool
            Whether what changes may depend on these and on constants only.
        """
        for number, limits, size in moved:
            symbol = self.symbols[number]
            here = float(own[number])
            reach = max(abs(here), size) or 1.0
            for places in _ranges(here, limits, reach):
                values = self._values(own, number)
                for found in self.stepping.along(places, values, symbol.symbol):
                    others = resolve(found.cause, "a comparison")
                    if alone and not all(isinstance(s, (Unknown, Constant)) for s in others):
                        continue
                    yield NumberStep(
                        expression=self.owners[found.column],
                        condition=cause_text(found),
                        number=text_of(symbol),
                        unit=symbol.unit,
                        place=found.place if abs(found.place) > _ZERO * reach else 0.0,
                        own=here,
                        size=found.size,
                        away=abs(found.place - here) / reach,
                    )

    def _values(self, own: Array, number: int) -> Callable[[tuple[ca.SX, ...], Array], Array]:
        """Expressions at values of one number, where all others have their own."""

        def values(expressions: tuple[ca.SX, ...], places: Array) -> Array:
            key = tuple(e.element_hash() for e in expressions)
            if key not in self.functions:
                stacked = ca.densify(ca.vertcat(*expressions))
                inputs = [ca.vertcat(*self.stepping.symbols)]
                self.functions[key] = ca.Function("expressions", inputs, [stacked])
            rows = np.tile(own, (len(places), 1))
            rows[:, number] = places
            return columnwise(self.functions[key], rows)[0]

        return values


def _ranges(own: float, limits: Interval, reach: float) -> Iterator[Array]:
    """Values of a number that are looked at: near its own, farther off, and between its limits."""
    around = ((own - far * reach, own + far * reach) for far in (1.0, _FAR))
    for low, high in dict.fromkeys([*(_both(limits, each) for each in around), limits]):
        if math.isfinite(high - low) and high > low:
            yield np.linspace(low, high, _VALUES)


def _of_the_problem(iterate: Iterate, evaluator: Evaluator) -> Iterator[NumberStep]:
    """Steps of the objective and of the constraints on numbers of the whole motion."""
    problem, trajectory = iterate.problem, iterate.trajectory

    def made() -> _Lines | None:
        bounds = [(owner_text(b), b.expression) for b in problem.boundary_constraints]
        return _Lines.of([("the objective", problem.objective), *bounds])

    lines = evaluator.once("steps of numbers", made)
    if lines is None:
        return
    peaks = trajectory.peaks_of(problem)
    own = np.array([evaluator.number(trajectory, s, peaks) for s in lines.symbols])
    moved = [
        (number, _limits(iterate, symbol), _size(iterate, symbol))
        for number, symbol in enumerate(lines.symbols)
        if not isinstance(symbol, Constant)
    ]
    yield from lines.along(own, moved)


def _of_a_value(
    iterate: Iterate, evaluator: Evaluator, functional: BoundaryValue | PointValue
) -> Iterator[NumberStep]:
    """Steps of a value at one instant, as the signals there change."""
    owner = f"the {text_of(functional)}"
    key = ("steps of a value", functional.symbol.element_hash())
    lines = evaluator.once(key, lambda: _Lines.of([(owner, functional.expression)]))
    if lines is None:
        return
    motion = iterate.trajectory.phase(functional.phase)
    place = (0, 0.0)
    if isinstance(functional, PointValue):
        intervals, local = motion.locate(np.array([functional.instant]))
        place = int(intervals[0]), float(local[0])
    elif functional.end == "end":
        place = motion.intervals - 1, 1.0
    symbols = lines.stepping.symbols
    own = evaluator.values(iterate.trajectory, functional.phase, symbols, place[0], [place[1]])[0]
    moved = [
        (number, _limits(iterate, symbol, functional), _size(iterate, symbol))
        for number, symbol in enumerate(lines.symbols)
        if not isinstance(symbol, (Constant, Time))
    ]
    yield from lines.along(own, moved)


def _of_a_phase(
    iterate: Iterate,
    evaluator: Evaluator,
    phase: str,
    signals: Mapping[str, Interval] | None = None,
) -> Iterator[NumberStep]:
    """Steps of what holds along a phase, as parameters of the problem change.

    Parameters
    ----------
    signals : mapping of str to (lower, upper), optional
        Limits of the signals, where these are moved as well.
    """

    def made() -> _Lines | None:
        return _Lines.of([(owner_text(o), e) for o, e in path_expressions(iterate.problem, phase)])

    lines = evaluator.once(("steps of parameters", phase), made)
    if lines is None:
        return
    moved = [
        (
            number,
            (signals or {}).get(symbol.name, _ANY)
            if isinstance(symbol, Signal)
            else _limits(iterate, symbol),
            _size(iterate, symbol),
        )
        for number, symbol in enumerate(lines.symbols)
        if isinstance(symbol, Unknown) or (isinstance(symbol, Signal) and signals is not None)
    ]
    if not moved:
        return
    motion = iterate.trajectory.phase(phase)
    times = _instants(motion, iterate.problem.instants[phase])
    symbols = lines.stepping.symbols
    for own in evaluator.values(iterate.trajectory, phase, symbols, *motion.locate(times)):
        yield from lines.along(own, moved, alone=signals is None)


def _instants(motion: PhaseTrajectory, known: Sequence[float]) -> Array:
    """Instants of a phase, and one between any two known times: what steps there may be short."""
    equal = motion.start + (np.arange(_INSTANTS) + 0.5) / _INSTANTS * (motion.end - motion.start)
    inside = [time for time in known if motion.start < time < motion.end]
    if not inside:
        return np.asarray(equal)
    ends = np.array([motion.start, *inside, motion.end])
    return np.sort(np.concatenate([equal, 0.5 * (ends[1:] + ends[:-1])]))


def _limits(iterate: Iterate, symbol: Symbol, at: Functional | None = None) -> Interval:
    """Between which a number may lie; a signal at an instant of a functional."""
    parameters = iterate.parameters
    if isinstance(symbol, Unknown):
        limits = parameters.unknown_limits[symbol.name]
    elif isinstance(symbol, Signal):
        limits = parameters.signal_limits[symbol.name]
        if isinstance(at, BoundaryValue):
            ends = parameters.initial_values if at.end == "start" else parameters.final_values
            limits = _both(limits, ends.get((at.phase, symbol.name), _ANY))
    elif isinstance(symbol, PhaseTime):
        phase = iterate.problem.phase(symbol.phase)
        time = phase.start if symbol.end == "start" else phase.end
        limits = (time.lower, time.upper) if isinstance(time, Between) else (time, time)
    elif isinstance(symbol, BoundaryValue) and symbol.expression.is_symbolic():
        limits = _limits(iterate, resolve(symbol.expression, "a value")[0], symbol)
    else:
        limits = _ANY
    for bound in iterate.problem.boundary_constraints:
        if ca.is_equal(bound.expression, symbol.symbol):
            limits = _both(limits, parameters.bound_limits["", bound.name])
    return limits


def _both(first: Interval, second: Interval) -> Interval:
    return max(first[0], second[0]), min(first[1], second[1])


def _size(iterate: Iterate, symbol: Symbol) -> float:
    """The typical size of a number."""
    scales = iterate.scales
    if isinstance(symbol, Unknown):
        return scales.unknowns[symbol.name]
    if isinstance(symbol, Signal):
        return scales.signals[symbol.name]
    if isinstance(symbol, PhaseTime):
        return scales.time
    if isinstance(symbol, BoundaryValue) and symbol.expression.is_symbolic():
        return _size(iterate, resolve(symbol.expression, "a value")[0])
    return scales.functionals.get(symbol, 0.0) if isinstance(symbol, Functional) else 0.0
