"""What scaling was chosen, and why, for people to read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from ocp.mesh.initial_guess import start_of
from ocp.mesh.trajectory import Trajectory
from ocp.problem.statement import Problem
from ocp.problem.symbols import Constant, Signal
from ocp.transcription.scaling import Scales, scales_of


@dataclass(frozen=True)
class ScaleEntry:
    """The size by which one signal, number or row is divided.

    Attributes
    ----------
    kind : "signal", "unknown", "time", "bound", "number" (integral or peak) or "objective".
    size : in the unit.
    reason : where it comes from; "stated" where the statement says so.
    """

    kind: str
    name: str
    unit: str
    size: float
    reason: str


@dataclass(frozen=True)
class ScalingReport:
    """All sizes of a problem; prints as a table."""

    problem: str
    entries: tuple[ScaleEntry, ...]

    def __str__(self) -> str:
        width = max(len(e.name) for e in self.entries)
        units = max(len(e.unit) for e in self.entries)
        lines = [
            f"  {e.kind:9s}  {e.name:{width}s}  {e.size:10.4g}  {e.unit:{units}s}  {e.reason}"
            for e in self.entries
        ]
        return "\n".join([f"scaling of '{self.problem}'", *lines])


def scaling_report(
    problem: Problem, *, guess: Trajectory | None = None,
    constants: Mapping[Constant, float] | None = None,
) -> ScalingReport:  # fmt: skip
    """The sizes that `ocp.solve` takes for a problem, before it is solved.

    To choose another one, give ``scale`` where the thing is stated: a signal, an unknown, a bound,
    an integral, a peak, or the problem for its objective.
    """
    values = {c.name: float(c.value) for c in problem.constants}
    values |= {c.name: float(v) for c, v in (constants or {}).items()}
    return report_of(problem, scales_of(problem, start_of(problem, values, guess), values))


def report_of(problem: Problem, scales: Scales) -> ScalingReport:
    """The report of given scales."""
    return ScalingReport(problem.name, tuple(_entries(problem, scales)))


def _entries(problem: Problem, scales: Scales) -> Iterator[ScaleEntry]:
    why = scales.reasons
    for s in problem.symbols:
        if isinstance(s, Signal):
            yield ScaleEntry("signal", s.name, s.unit, scales.signals[s.name],
                             why["signal", s.name])  # fmt: skip
    for u in problem.unknowns:
        yield ScaleEntry("unknown", u.name, u.unit, scales.unknowns[u.name],
                         why["unknown", u.name])  # fmt: skip
    yield ScaleEntry("time", "durations", "s", scales.time, why["time", ""])
    named = [(phase.name, b) for phase in problem.phases for b in phase.bounds]
    for phase, b in (*named, *(("", b) for b in (*problem.bounds, *problem.links))):
        name = f"{phase}: {b.name}" if phase else b.name
        yield ScaleEntry("bound", name, b.unit, scales.bounds[phase, b.name],
                         why["bound", (phase, b.name)])  # fmt: skip
    for f in (f for f in problem.functionals if f.kind in ("integral", "peak")):
        yield ScaleEntry("number", f.name, f.unit, scales.functionals[f], why["number", f])
    yield ScaleEntry("objective", "objective", "", scales.objective, why["objective", ""])
