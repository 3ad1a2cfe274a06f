"""The problem as one states it, as text."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from ocp.problem.symbols import Between, Signal, Unknown, is_number
from ocp.problem.texts import SHORT, text_of, unit_of

if TYPE_CHECKING:
    from ocp.problem.bounds import Bound
    from ocp.problem.phase import Phase
    from ocp.problem.problem import Problem


def objective_unit(problem: Problem) -> str:
    """The unit of the objective, "1" where its terms do not tell."""
    return unit_of(problem.objective) or "1"


def with_unit(text: str, unit: str) -> str:
    """A number with its unit; without, if that is 1."""
    return text if unit in ("", "1") else f"{text} {unit}"


def problem_summary(problem: Problem) -> str:
    """One line: what is asked for, and how large the problem is."""
    parts = [
        _counted(len(problem.phases), "phase"),
        _counted(len({s for p in problem.phases for s in p.states}), "state"),
        _counted(len({s for p in problem.phases for s in problem.controls[p.name]}), "control"),
    ]
    sense, objective = _objective(problem)
    return f"Problem('{problem.name}': {sense} {text_of(objective, SHORT)}; {', '.join(parts)})"


def problem_text(problem: Problem) -> str:
    """The problem as a textbook states it: objective, dynamics, boundary values, bounds."""
    sense, objective = _objective(problem)
    sections = [(sense, [_with_bracket(text_of(objective), objective_unit(problem))])]
    for phase in problem.phases:
        sections.append((f"phase '{phase.name}'", [_times(phase)]))
        sections += [(f"  {what}", lines) for what, lines in _phase_sections(problem, phase)]

    sections.append(("bounds", [_bound_text(b) for b in problem.bounds]))
    sections.append(("links", [_bound_text(b) for b in problem.links]))
    sections.append(("unknowns", [_limits_text(u.name, u) for u in problem.unknowns]))
    constants = [with_unit(f"{c.name} = {c.value:g}", c.unit) for c in problem.constants]
    sections.append(("constants", constants))
    return "\n".join([f"Problem '{problem.name}'", *_aligned(sections)])


def phase_summary(phase: Phase) -> str:
    """One line: the times, and how many states and bounds."""
    states = _counted(len(phase.states), "state")
    return (
        f"Phase('{phase.name}': {states}, {_counted(len(phase.bounds), 'bound')}, {_times(phase)})"
    )


def _aligned(sections: Sequence[tuple[str, Sequence[str]]]) -> Iterator[str]:
    """Each section's title beside its lines; empty sections are left out."""
    width = max(len(title) for title, lines in sections if lines)
    for title, lines in sections:
        for number, line in enumerate(lines):
            yield f"  {title if number == 0 else '':<{width}}   {line}"


def _objective(problem: Problem) -> tuple[str, Any]:
    if problem.minimise is not None:
        return "minimise", problem.minimise
    return "maximise", problem.maximise


def _phase_sections(problem: Problem, phase: Phase) -> Iterator[tuple[str, list[str]]]:
    yield "dynamics", [f"d {s.name}/dt = {text_of(rate)}" for s, rate in phase.dynamics.items()]
    for what, values in (("initial", phase.initial), ("final", phase.final)):
        yield what, [_value_text(state, value) for state, value in values.items()]
    for what, signals in (
        ("states", phase.states),
        ("controls", problem.controls[phase.name]),
        ("algebraic", problem.algebraics[phase.name]),
    ):
        yield what, [_limits_text(signal.name, signal) for signal in signals]
    yield "bounds", [_bound_text(bound) for bound in phase.bounds]


def _times(phase: Phase) -> str:
    start, end = (
        f"{t.lower:g} to {t.upper:g} s (free)" if isinstance(t, Between) else f"{t:g} s"
        for t in (phase.start, phase.end)
    )
    return f"from {start} to {end}" if "free" not in start + end else f"start {start}, end {end}"


def _value_text(state: Signal, value: Any) -> str:
    if isinstance(value, tuple):
        lower, upper = value
        return _between(state.name, lower, upper, state.unit)
    return with_unit(f"{state.name} = {_limit_text(value)}", state.unit)


def _limits_text(name: str, symbol: Signal | Unknown) -> str:
    return _between(name, symbol.lower, symbol.upper, symbol.unit)


def _bound_text(bound: Bound) -> str:
    text = text_of(bound.expression)
    limits = _between(text, bound.lower, bound.upper, bound.unit)
    # a bound that was written as a relation has the relation as its name
    return limits if bound.name.startswith(text) else f"{bound.name}: {limits}"


def _between(text: str, lower: Any, upper: Any, unit: str) -> str:
    """An expression between limits, one-sided or equal ones included."""
    low, high = (None if _is_infinite(limit) else _limit_text(limit) for limit in (lower, upper))
    if low is None and high is None:
        return _with_bracket(text, unit)
    if low == high:
        return with_unit(f"{text} = {low}", unit)
    if low is None:
        return with_unit(f"{text} <= {high}", unit)
    if high is None:
        return with_unit(f"{text} >= {low}", unit)
    return with_unit(f"{low} <= {text} <= {high}", unit)


def _is_infinite(limit: Any) -> bool:
    return is_number(limit) and math.isinf(limit)


def _limit_text(limit: Any) -> str:
    return f"{float(limit):g}" if is_number(limit) else text_of(limit)


def _with_bracket(text: str, unit: str) -> str:
    return text if unit in ("", "1") else f"{text}   [{unit}]"


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"
