"""A figure of a solution.  The one module of the package that draws.

Matplotlib is loaded when this module is, which is when a user asks for a plot.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ocp.arrays import Array, Integers
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.problem.display import objective_unit, with_unit
from ocp.problem.parameters import parameters_of
from ocp.problem.symbols import Signal

if TYPE_CHECKING:
    from ocp.solution.solution import Solution

__all__ = ["Figure", "plot"]

_PER_INTERVAL = 24  # points of a curve
_MOST_ROWS = 6  # of panels in a column
_WIDTH, _HEIGHT = 4, 2  # of a panel [inch]
_LINE, _LIMIT, _MESH = "#0b5fa5", "#d1495b", "0.45"  # told apart by the colour-blind
_FAR = 2.0  # ranges of a curve: limits farther from it would flatten it and are left out
_FLAT = 1e-6  # part of its size within which a curve counts as constant: the rest is rounding


@dataclass(frozen=True, eq=False)
class TimeHistory:
    """What one panel shows.

    Attributes
    ----------
    kind : str
        "state", "control", "algebraic", "path constraint" or "costate".
    pieces : list of (times, values)
        One for each phase that has it.
    lower, upper : list of (start, end, limit)
        Finite limits in each phase.
    """

    kind: str
    name: str
    unit: str
    pieces: list[tuple[Array, Array]]
    limits: list[tuple[float, float, float]]


def plot(solution: Solution) -> Figure:
    """States, controls, path constraints and costates over time.

    Limits are dashed lines.  Ticks at the bottom of each panel are the mesh, dotted lines the
    instants at which phases meet.

    Returns
    -------
    Figure
        To be saved with ``figure.savefig(path)``; a notebook shows it.
    """
    columns = [column for column in _columns(solution) if column]
    rows = max(len(column) for column in columns)
    size = (_WIDTH * len(columns), _HEIGHT * rows + 1)
    figure = Figure(figsize=size, layout="constrained")
    figure.suptitle(_title(solution), fontsize="medium")

    panels = figure.subplots(rows, len(columns), sharex=True, squeeze=False)
    for j, column in enumerate(columns):
        for i in range(rows):
            if i < len(column):
                _draw(panels[i, j], column[i], solution)
            else:
                panels[i, j].remove()
        last = panels[len(column) - 1, j]
        last.set_xlabel("time [s]")
        last.tick_params(labelbottom=True)
    return figure


def _title(solution: Solution) -> str:
    sense = "minimum" if solution.problem.sense > 0 else "maximum"
    value = with_unit(f"{solution.objective:.6g}", objective_unit(solution.problem))
    return f"{solution.problem.name}: {sense} {value}\n{solution.verdict}"


def _columns(solution: Solution) -> Iterator[list[TimeHistory]]:
    """Panels by columns, each kind in columns of its own."""
    inputs = [*_signals(solution, "control"), *_signals(solution, "algebraic")]
    for curves in (
        list(_signals(solution, "state")),
        [*inputs, *_path_constraints(solution)],
        list(_costates(solution)),
    ):
        for first in range(0, len(curves), _MOST_ROWS):
            yield curves[first : first + _MOST_ROWS]


def _points(motion: PhaseTrajectory) -> tuple[Array, Integers, Array]:
    """Times, intervals and local times of a phase, both ends of every interval included."""
    intervals = np.repeat(np.arange(motion.intervals), _PER_INTERVAL)
    tau = np.tile(np.linspace(0.0, 1.0, _PER_INTERVAL), motion.intervals)
    times = motion.breakpoints[intervals] + tau * np.diff(motion.breakpoints)[intervals]
    return times, intervals, tau


def _signals(solution: Solution, kind: str) -> Iterator[TimeHistory]:
    """All signals of a kind, in the order in which they appear."""
    symbols = {s.name: s for s in solution.problem.symbols if isinstance(s, Signal)}
    motions = solution.trajectory.phases
    groups = [(m, g) for m in motions for g in m.groups if g.kind == kind]
    for name in dict.fromkeys(name for _, group in groups for name in group.names):
        curve = TimeHistory(kind, name, symbols[name].unit, [], [])
        for motion in motions:
            if name in motion.signals:
                times, intervals, tau = _points(motion)
                values = motion.polynomial(name).value(intervals, tau)[:, 0]
                curve.pieces.append((times, values))
                _add_limits(curve, solution, motion, symbols[name])
        yield curve


def _path_constraints(solution: Solution) -> Iterator[TimeHistory]:
    """The bounds of each phase, those of one name in one panel; equations show nothing."""
    curves: dict[str, TimeHistory] = {}
    for phase, motion in zip(solution.problem.phases, solution.trajectory.phases, strict=True):
        times, intervals, tau = _points(motion)
        for bound in (b for b in phase.bounds if not b.is_equation):
            values = solution.evaluator.values(
                solution.trajectory, phase.name, [bound.expression], intervals, tau
            )
            curve = curves.setdefault(
                bound.name, TimeHistory("path constraint", bound.name, bound.unit, [], [])
            )
            curve.pieces.append((times, values[:, 0]))
            _add_limits(curve, solution, motion, bound)
    yield from curves.values()


def _add_limits(curve: TimeHistory, solution: Solution, motion: PhaseTrajectory, item: Any) -> None:
    parameters = parameters_of(solution.problem, solution.trajectory.constants)
    for limit in dict.fromkeys(parameters.limit(side) for side in (item.lower, item.upper)):
        if np.isfinite(limit):
            curve.limits.append((motion.start, motion.end, limit))


def _costates(solution: Solution) -> Iterator[TimeHistory]:
    """Costates of all states and running integrals."""
    if solution.multipliers is None:
        return
    curves: dict[str, TimeHistory] = {}
    solved = solution.form.problem
    units = {s.name: s.unit for s in (*solved.symbols, *solved.functionals)}
    objective = objective_unit(solution.problem)
    for costates in solution.multipliers.costates:
        times, intervals, tau = _points(solution.trajectory.phase(costates.name))
        values = costates.local(intervals, tau)
        for j, name in enumerate(costates.names):
            unit = _quotient(objective, units[name])
            curve = curves.setdefault(
                name, TimeHistory("costate", f"costate of {name}", unit, [], [])
            )
            curve.pieces.append((times, values[:, j]))
    yield from curves.values()


def _quotient(unit: str, divisor: str) -> str:
    """A unit divided by another, as text."""
    if unit == divisor:
        return "1"
    if divisor == "1":
        return unit
    return "/".join(f"({part})" if "/" in part else part for part in (unit, divisor))


def _draw(panel: Axes, curve: TimeHistory, solution: Solution) -> None:
    """One panel."""
    for times, values in curve.pieces:
        panel.plot(times, values, color=_LINE)
    values = np.concatenate([v for _, v in curve.pieces])
    largest, span = float(np.abs(values).max()), float(np.ptp(values))
    if span < _FLAT * largest:
        span = largest
        panel.set_ylim(values.mean() - 0.5 * span, values.mean() + 0.5 * span)
    for start, end, limit in curve.limits:
        if values.min() - _FAR * span <= limit <= values.max() + _FAR * span:
            panel.plot([start, end], [limit, limit], color=_LIMIT, lw=1, ls="--")

    motions = solution.trajectory.phases
    for motion in motions:
        # at the bottom of the panel, whatever its vertical axis
        at_bottom = panel.get_xaxis_transform()
        points = motion.breakpoints
        panel.plot(points, np.zeros(points.size), "|", color=_MESH, transform=at_bottom)
    for motion in motions[1:]:
        panel.axvline(motion.start, color=_MESH, lw=1, ls=":")

    label = curve.name if curve.unit == "1" else f"{curve.name} [{curve.unit}]"
    panel.set_title(label, fontsize="small", loc="left")
    panel.grid(color="0.92")
    panel.set_axisbelow(True)
    panel.margins(x=0)
    panel.tick_params(labelsize="small")
    panel.ticklabel_format(axis="y", style="sci", scilimits=(-3, 3), useMathText=True)
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)
