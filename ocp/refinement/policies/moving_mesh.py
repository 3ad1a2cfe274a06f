"""Meshes of few intervals whose breakpoints all move: made for one motion, they follow the next.

Along a family of motions the ends of arcs and the switches move. On a mesh that stays they leave
the fine intervals that were made for them, and the active set changes at many points. Breakpoints
that move keep each arc in its own intervals: the nonlinear program, the active set and so the warm
start stay. It takes a mesh whose breakpoints are near their places already, such as `coarsened`
makes of a solution: on others breakpoints drag each other astray.

That merges neighbouring intervals wherever one polynomial does for all of them. A mesh that was
refined holds intervals that its motion no longer needs: bisection leaves a trail on its way to a
switch, and a uniform first mesh cuts long arcs in pieces. Breakpoints that a motion needs are the
ends of its arcs, and a few where an arc is curved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ocp.accuracy import Accuracy
from ocp.arrays import Array, Integers
from ocp.estimates.motion_errors import MotionErrors
from ocp.keywords import as_written, checked_keywords
from ocp.mesh.mesh import ExtraPoints, Mesh, PhaseMesh
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory, Trajectory
from ocp.numerics.piecewise_polynomial import chebyshev_extrema
from ocp.numerics.schemes import Scheme
from ocp.optimality.iterate import Iterate
from ocp.refinement.policies.adaptive_mesh import AdaptiveMesh
from ocp.refinement.policies.policy import HIGHEST_DEGREE, MeshPolicy, check_counts
from ocp.refinement.solved_mesh import SolvedMesh
from ocp.transcription.transcribe import Transcription

# Samples of an interval: both ends, so that a jump between two intervals counts as one.
_SAMPLES = chebyshev_extrema(5)

# Of the phase: constraints are imposed at the points of an interval, so none is longer than this.
_WIDEST = 0.2


def coarsened(trajectory: Trajectory, tolerance: float) -> Mesh:
    """The mesh of a motion without the breakpoints that its signals do not need.

    Parameters
    ----------
    trajectory : Trajectory
    tolerance : float
        Of the range of a signal, by which one polynomial may differ from those that it replaces.
        Controls keep the order that they have, states the degree of their interval.
    """
    return Mesh(tuple(_coarsened(motion, tolerance) for motion in trajectory.phases))


def _coarsened(motion: PhaseTrajectory, tolerance: float) -> PhaseMesh:
    signals = _sampled(motion)
    kept, degrees = [0], list[int]()
    while kept[-1] < motion.intervals:
        first = last = kept[-1]
        while last + 1 < motion.intervals and _is_one(motion, signals, first, last + 1, tolerance):
            last += 1
        kept.append(last + 1)
        degrees.append(int(motion.degrees[first : last + 1].max()))
    return PhaseMesh(motion.fractions[kept], np.array(degrees))


def _sampled(motion: PhaseTrajectory) -> list[tuple[Integers, Array]]:
    """Orders (N,) of each state and control, and its samples (N, m) relative to its range."""
    intervals = np.repeat(np.arange(motion.intervals), _SAMPLES.size)
    tau = np.tile(_SAMPLES, motion.intervals)
    sampled = []
    for name in (*motion.states, *motion.controls):
        polynomial = motion.polynomial(name)
        values = polynomial.value(intervals, tau).reshape(motion.intervals, -1)
        if (size := float(np.ptp(values))) > 0.0:
            sampled.append((polynomial.orders, values / size))
    return sampled


def _is_one(
    motion: PhaseTrajectory,
    signals: list[tuple[Integers, Array]],
    first: int,
    last: int,
    tolerance: float,
) -> bool:
    """Whether one polynomial a signal does for the intervals from the first to the last."""
    points, here = motion.fractions[first : last + 2], slice(first, last + 1)
    width = points[-1] - points[0]
    if width > _WIDEST:
        return False
    at = ((points[:-1, None] + np.diff(points)[:, None] * _SAMPLES) - points[0]) / width
    for orders, values in signals:
        basis = np.polynomial.legendre.legvander(2 * at.ravel() - 1, int(orders[here].max()))
        wanted = values[here].ravel()
        fitted = basis @ np.linalg.lstsq(basis, wanted, rcond=None)[0]
        if np.abs(fitted - wanted).max() > tolerance:
            return False
    return True


# Of its width, that an interval may grow to at once: on a longer one a constraint would be
# exceeded between its points, which an optimiser uses.
_LONGEST = 1.5

# Parts of its width, within which an interval still leaves its neighbours of the family room: if
# not, the limits of all widths are set anew from where the breakpoints are.
_ROOM = (0.5, 1.2)

# Of the phase: an interval this narrow stands for nothing.
_VANISHED = 1e-5

# Of its size: a constraint as near to its limit as this may be exceeded between the points of an
# interval that has become longer.
_NEAR = 0.02


@checked_keywords()
@dataclass(frozen=True, repr=False)
class MovingMesh:
    """Meshes that adapt, all of whose breakpoints move; the first one is kept if it will do.

    Parameters
    ----------
    rounds : int
        Most meshes that are solved.
    most_intervals : int
        Of a phase.
    highest_degree : int
        Of an interval.
    kept : Accuracy, optional
        Within which the first mesh is kept, where that is less than the settings ask for: what was
        refined for a neighbour serves some more.

    Raises
    ------
    StatementError
        For a number that is no positive integer.
    """

    rounds: int = 2
    most_intervals: int = 200
    highest_degree: int = HIGHEST_DEGREE
    kept: Accuracy | None = None

    adapts: ClassVar[bool] = True

    def __repr__(self) -> str:
        return as_written(self)

    def __post_init__(self) -> None:
        check_counts(self, "a moving mesh", "rounds", "most_intervals", "highest_degree")

    def next_mesh(self, solved: Sequence[SolvedMesh], accuracy: Accuracy) -> Mesh | None:
        """A better mesh, all of it movable, or None when the last one will do."""
        last = solved[-1]
        enough = self.kept if self.kept is not None and len(solved) == 1 else accuracy
        if last.meets(enough):
            return None

        following = AdaptiveMesh(
            rounds=self.rounds,
            most_intervals=self.most_intervals,
            highest_degree=self.highest_degree,
            move_breakpoints=False,
        ).next_mesh(solved, accuracy)
        return None if following is None else following.freed(_LONGEST)

    def after_failure(
        self, solved: Sequence[SolvedMesh], failed: Mesh, accuracy: Accuracy
    ) -> tuple[MeshPolicy, Mesh] | None:
        """None: where breakpoints led the solver astray, another mesh is the caller's to choose."""
        return None


@dataclass(frozen=True)
class KeptWhileGood:
    """Another policy, but a first mesh that meets all tolerances is kept as it is.

    Breakpoints that move would otherwise be settled where they are, on a mesh that is solved again.

    Parameters
    ----------
    policy : MeshPolicy
        Of all meshes after the first.
    """

    policy: MeshPolicy

    @property
    def adapts(self) -> bool:
        return self.policy.adapts

    @property
    def rounds(self) -> int:
        return self.policy.rounds

    @property
    def highest_degree(self) -> int:
        return self.policy.highest_degree

    def next_mesh(self, solved: Sequence[SolvedMesh], accuracy: Accuracy) -> Mesh | None:
        """None after a first mesh that is good enough; else that of the policy."""
        if len(solved) == 1 and solved[0].meets(accuracy):
            return None
        return self.policy.next_mesh(solved, accuracy)

    def after_failure(
        self, solved: Sequence[SolvedMesh], failed: Mesh, accuracy: Accuracy
    ) -> tuple[MeshPolicy, Mesh] | None:
        """That of the policy."""
        return self.policy.after_failure(solved, failed, accuracy)


def moving_mesh(iterate: Iterate, evaluator: Evaluator, tolerance: float) -> Mesh:
    """A mesh that follows a motion to its neighbours: the very mesh that it has if that will do.

    Parameters
    ----------
    iterate : Iterate
        The motion, on its own mesh.
    evaluator : Evaluator
        Of its problem.
    tolerance : float
        Of `coarsened`, which the mesh is if it does not move yet. One that moves is not merged
        again: what each time is worth little adds up.
    """
    mesh, trajectory = iterate.mesh, iterate.trajectory
    if not any(phase.movable for phase in mesh.phases):
        return movable_mesh(iterate, evaluator, tolerance)
    ratios = _ratios(mesh, trajectory)
    narrowest = min(float(np.diff(motion.fractions).min()) for motion in trajectory.phases)
    if narrowest >= _VANISHED and _ROOM[0] <= ratios.min() and ratios.max() <= _ROOM[1]:
        return mesh
    return _where_it_is(mesh, trajectory).freed(_LONGEST)


def price_of_widths(program: Transcription, row_multipliers: Array) -> float:
    """What the limits of all widths cost, were each wider by its width on the mesh, to first order.

    Where they cost something the motion is another one on a mesh made of where its breakpoints are.

    Parameters
    ----------
    row_multipliers : (m,)
        Scaled.

    Returns
    -------
    float
        Of the objective, scaled.
    """
    parts = [row_multipliers[own.breakpoints] for own in program.rows.phases]
    return float(np.abs(np.concatenate(parts)).sum())


def movable_mesh(iterate: Iterate, evaluator: Evaluator, tolerance: float) -> Mesh:
    """A mesh of as few intervals as a motion needs, whose breakpoints all move, made anew."""
    return merged_mesh(iterate, evaluator, tolerance).freed(_LONGEST)


def merged_mesh(iterate: Iterate, evaluator: Evaluator, tolerance: float) -> Mesh:
    """A mesh as coarse as `coarsened`, its constraints imposed more densely where they are near."""
    mesh, motions = coarsened(iterate.trajectory, tolerance), iterate.trajectory.phases
    errors = MotionErrors(iterate.transcription, iterate.trajectory, evaluator, iterate.parameters)
    extra = []
    for motion, phase, excess in zip(motions, mesh.phases, errors.excess, strict=True):
        parents = np.searchsorted(phase.breakpoints, motion.fractions[:-1], side="right") - 1
        points = []
        for number, extremes in enumerate(excess):
            near = np.unique(parents[extremes.values > -_NEAR])
            if near.size:
                points.append(_between_the_points(number, near, phase, motion.scheme))
        extra.append(tuple(points))
    return Mesh(mesh.phases, tuple(extra))


def _between_the_points(
    constraint: int, intervals: Integers, mesh: PhaseMesh, scheme: Scheme
) -> ExtraPoints:
    """A point of a constraint in the middle between any two collocation points of intervals."""
    places = []
    for interval in intervals:
        points = np.unique([0.0, *scheme.at(int(mesh.degrees[interval])).points, 1.0])
        places.append((points[:-1] + points[1:]) / 2)
    counts = [tau.size for tau in places]
    return ExtraPoints(constraint, np.repeat(intervals, counts), np.concatenate(places))


def _where_it_is(mesh: Mesh, trajectory: Trajectory) -> Mesh:
    """A mesh with its breakpoints where a motion has them, without intervals that have vanished."""
    phases, extra, back_off = [], [], []
    parts = zip(trajectory.phases, mesh.extra, mesh.back_off, strict=True)
    for motion, points_of_phase, held in parts:
        kept = np.diff(motion.fractions) >= _VANISHED
        number = np.cumsum(kept) - 1
        # an interval that is left begins where the one before it ends
        breakpoints = np.append(motion.fractions[:-1][kept], 1.0)
        breakpoints[0] = 0.0
        phases.append(PhaseMesh(breakpoints, motion.degrees[kept]))
        extra.append(
            tuple(
                ExtraPoints(points.constraint, number[points.intervals[here]], points.tau[here])
                for points in points_of_phase
                if (here := kept[points.intervals]).any()
            )
        )
        back_off.append({constraint: values[kept] for constraint, values in held.items()})
    return Mesh(tuple(phases), tuple(extra), tuple(back_off))


def _ratios(mesh: Mesh, trajectory: Trajectory) -> Array:
    """Widths of all intervals in a motion, relative to those of its mesh, (N,)."""
    pairs = zip(mesh.phases, trajectory.phases, strict=True)
    return np.concatenate([np.diff(m.fractions) / np.diff(p.breakpoints) for p, m in pairs])
