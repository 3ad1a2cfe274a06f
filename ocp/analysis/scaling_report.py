"""What scaling was chosen, and why, for people to read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from ocp.keywords import checked_keywords
from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.trajectory import Trajectory
from ocp.problem.functionals import Integral, Peak
from ocp.problem.problem import Problem, check_is_problem
from ocp.problem.symbols import Constant, Signal
from ocp.reformulate.form import reformulated
from ocp.reformulate.standard import STANDARD_REFORMULATIONS
from ocp.scaling.automatic import scales_of
from ocp.scaling.scales import Scales


@dataclass(frozen=True)
class ScaleEntry:
    """The size by which one signal, number or row is divided.

    Attributes
    ----------
    kind : str
        "signal", "unknown", "time", "bound", "number" (integral or peak) or "objective".
    name, unit : str
    size : float
        In the unit.
    reason : str
        Where it comes from; "stated" where the statement says so.
    """

    kind: str
    name: str
    unit: str
    size: float
    reason: str


@dataclass(frozen=True, repr=False)
class ScalingReport:
    """All sizes of a problem; prints as a table."""

    problem: str
    entries: tuple[ScaleEntry, ...]

    def __repr__(self) -> str:
        return f"ScalingReport('{self.problem}': {len(self.entries)} scales; print it)"

    def __str__(self) -> str:
        width = max(len(e.name) for e in self.entries)
        units = max(len(e.unit) for e in self.entries)
        lines = [
            f"  {e.kind:9s}  {e.name:{width}s}  {e.size:10.4g}  {e.unit:{units}s}  {e.reason}"
            for e in self.entries
        ]
        return "\n".join([f"scaling of '{self.problem}'", *lines])


@checked_keywords()
def scaling_report(
    problem: Problem,
    *,
    guess: Trajectory | None = None,
    constants: Mapping[Constant, float] | None = None,
) -> ScalingReport:
    """The sizes that `ocp.solve` takes for a problem, before it is solved.

    To choose another one, give ``scale`` where the thing is stated: a signal, an unknown, a bound,
    an integral, a peak, or the problem for its objective.

    Parameters
    ----------
    problem : Problem
    guess : Trajectory, optional
        Instead of the guess in the statement.
    constants : mapping of Constant to number, optional
        Values that replace those of the statement.
    """
    check_is_problem(problem)
    form = reformulated(problem, STANDARD_REFORMULATIONS)
    parameters = form.parameters(constants)
    known = None if guess is None else form.solved(guess)
    start = initial_guess(form.problem, parameters, known)
    return report_of(form.problem, scales_of(form.problem, start, parameters))


def report_of(problem: Problem, scales: Scales) -> ScalingReport:
    """The report of given scales."""
    return ScalingReport(problem.name, tuple(_entries(problem, scales)))


def _entries(problem: Problem, scales: Scales) -> Iterator[ScaleEntry]:
    why = scales.reasons
    for s in problem.symbols:
        if isinstance(s, Signal):
            size, reason = scales.signals[s.name], why["signal", s.name]
            yield ScaleEntry("signal", s.name, s.unit, size, reason)
    for u in problem.unknowns:
        size, reason = scales.unknowns[u.name], why["unknown", u.name]
        yield ScaleEntry("unknown", u.name, u.unit, size, reason)
    yield ScaleEntry("time", "durations", "s", scales.time, why["time", ""])

    bounds = [(phase.name, b) for phase in problem.phases for b in phase.bounds]
    bounds += [("", b) for b in problem.boundary_constraints]
    for phase, b in bounds:
        key = phase, b.name
        name = f"{phase}: {b.name}" if phase else b.name
        yield ScaleEntry("bound", name, b.unit, scales.bounds[key], why["bound", key])

    for f in problem.functionals:
        if isinstance(f, (Integral, Peak)):
            yield ScaleEntry("number", f.name, f.unit, scales.functionals[f], why["number", f])
    yield ScaleEntry("objective", "objective", "", scales.objective, why["objective", ""])
