"""A peer on a large problem: a process in an environment of its own, and the motion it answers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.processes import FreshProcess
from benchmarks.race.contestants import PEERS
from benchmarks.race.environments import NotInstalled, python_of
from benchmarks.records import ROOT
from ocp import Phase, PhaseTrajectory, Problem, Radau, Trajectory
from ocp.arrays import Array
from ocp.mesh.trajectory import SignalGroup, SignalKind
from ocp.numerics.piecewise_polynomial import Lagrange, Piece, PiecewisePolynomial
from ocp.problem.symbols import Signal
from studies.common.exit_codes import StudyError

NAME = "yapss"
SCRIPT = ROOT / "benchmarks" / "large" / "peers" / f"run_{NAME}.py"


def peer_process() -> FreshProcess:
    """The peer as a process that is asked for a problem and a number of intervals.

    It shares its environment with the race, and reads the same statement as the engine.
    """
    (peer,) = (contestant for contestant in PEERS if contestant.name == NAME)
    try:
        python = python_of(peer, ROOT / "results" / "environments")
    except NotInstalled as error:
        raise StudyError(f"{NAME} is {error}; leave out --peer") from error
    return FreshProcess((str(python), str(SCRIPT)), {"PYTHONPATH": str(ROOT)})


def motion_of(problem: Problem, phases: Sequence[Mapping[str, Any]], intervals: int) -> Trajectory:
    """The motion of a peer's answer.

    Parameters
    ----------
    phases : sequence of mapping
        Of each phase ``time`` (N d + 1,) with all breakpoints, ``state`` (n_x, N d + 1), and
        ``control`` (n_u, N d) at the points but the last one of each interval.
    intervals : int
        Their number N in each phase.
    """
    pairs = zip(problem.phases, phases, strict=True)
    return Trajectory(tuple(_phase_of(problem, phase, own, intervals) for phase, own in pairs))


def _phase_of(
    problem: Problem, phase: Phase, answer: Mapping[str, Any], intervals: int
) -> PhaseTrajectory:
    times = np.array(answer["time"])
    degree = (times.size - 1) // intervals
    breakpoints, first = times[::degree], times[: degree + 1]
    places = (first - first[0]) / (first[-1] - first[0])

    def polynomials(values: Array, points: int) -> PiecewisePolynomial:
        among = np.arange(intervals)[:, None] * degree + np.arange(points)
        basis = Lagrange(tuple(places[:points].tolist()))
        return PiecewisePolynomial(
            breakpoints, (Piece(np.arange(intervals), basis, values.T[among]),)
        )

    signals = problem.signals[phase.name]
    count, last = len(phase.states), len(signals) - len(problem.algebraics[phase.name])
    inputs = np.array(answer["control"])
    kinds: tuple[tuple[SignalKind, Sequence[Signal], Array, int], ...] = (
        ("state", phase.states, np.array(answer["state"]), degree + 1),
        ("control", signals[count:last], inputs[: last - count], degree),
        ("algebraic", signals[last:], inputs[last - count :], degree),
    )
    groups = tuple(
        SignalGroup(kind, tuple(s.name for s in of_kind), polynomials(values, points))
        for kind, of_kind, values, points in kinds
        if of_kind
    )
    degrees = np.full(intervals, degree)
    return PhaseTrajectory(phase.name, Radau(degree), breakpoints, degrees, groups)
