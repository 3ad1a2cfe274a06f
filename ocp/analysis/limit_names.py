"""The names of a problem's limits, by which one says what may give way."""

from __future__ import annotations

from collections.abc import Collection

from ocp.errors import StatementError
from ocp.problem.bounds import Bound
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import Signal, Symbol, Unknown, is_limited


class LimitNames:
    """The names of all limits of a problem that may give way.

    Attributes
    ----------
    names : of single limits.
    common : names of bounds, which stand for those of all phases.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        limited = (Signal, Unknown)
        self.names = {s.name for s in problem.symbols if isinstance(s, limited) and has_limit(s)}
        self.names |= {b.name for b in problem.bounds}

        self._of_phases: dict[str, set[str]] = {}
        for phase in problem.phases:
            for bound in phase.bounds:
                if not bound.is_equation:
                    name = phase_name(phase, bound)
                    self._of_phases.setdefault(bound.name, set()).add(name)
                    self.names.add(name)
            for what, values in (("initial", phase.initial), ("final", phase.final)):
                self.names |= {end_name(phase, state, what) for state in values}
        self.common = frozenset(self._of_phases) - self.names

    def each(self, names: Collection[str]) -> set[str]:
        """Names of single limits for names that may stand for several."""
        return {single for name in names for single in self._single(name)}

    def _single(self, name: str) -> set[str]:
        return self._of_phases[name] if name in self.common else {name}

    def check(self, names: Collection[str]) -> None:
        """StatementError unless there are limits of these names."""
        for name in names:
            if name not in self.names and name not in self.common:
                listed = ", ".join(f"'{n}'" for n in sorted(self.names))
                raise StatementError(
                    f"'{self.problem.name}' has no limit '{name}'; its limits are {listed}"
                )


def has_limit(symbol: Signal | Unknown) -> bool:
    """Whether a signal or an unknown is limited."""
    return is_limited(symbol.lower, symbol.upper)


def phase_name(phase: Phase, bound: Bound) -> str:
    """The name of a bound of a phase."""
    return f"{phase.name}: {bound.name}"


def end_name(phase: Phase, state: Symbol, what: str) -> str:
    """The name of an "initial" or "final" value."""
    return f"{phase.name}: {state.name} {what}"
