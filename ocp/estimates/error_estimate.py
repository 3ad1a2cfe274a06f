"""What is wrong with a solved mesh between its points: the motion's errors, and what is lost.

The errors of the motion alone are in `motion_errors`. A fixed breakpoint may hold a switch at the
wrong time; what that costs is asked here. The optimiser moves some inner breakpoints of a mesh, and
the others are *fixed*. Where a control jumps at a fixed one, its switch is *held* there. A held
switch that should come earlier or later is *displaced*. The policies *free* its breakpoint: from
the next mesh on it may move. A breakpoint at a known time is left out. It has to stay, and the
Hamiltonian may jump there.

The Hamiltonian tells what better controls gain inside the intervals. Where a control jumps at a
breakpoint that cannot move, the controls on both sides of it may be the best ones, and the jump
should come earlier or later all the same: before it a constraint may leave the controls no room,
but for the last part of an interval. Then the Hamiltonian jumps, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ocp.accuracy import Accuracy
from ocp.arrays import Array, Flags
from ocp.estimates.constrained_arcs import arc_gains
from ocp.estimates.estimated_gain import PhaseGains, weighted_by_effect, without_small_costs
from ocp.estimates.kink_crossings import KinkCrossings, kink_crossings
from ocp.estimates.motion_errors import MotionErrors
from ocp.estimates.switch_detection import Jump, control_jumps, switches_at_breakpoints
from ocp.mesh.mesh import SAME_POINT, ExtraPoints
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory
from ocp.numerics.piecewise_polynomial import Extremes
from ocp.optimality.active_set import ACTING, strongest_multipliers
from ocp.optimality.hamiltonian import relative_jumps, shifts
from ocp.optimality.iterate import Iterate

# Of the objective: what a shift by the shorter interval beside it has to gain. At the optima of
# the benchmarks the costates' errors look like gains of up to 3e-5, and a switch that was missed 1.
_MISSED = 1e-3

# Of the Hamiltonian's terms: by what it may differ on both sides of a switch. At the optima of the
# benchmarks the costates' errors leave up to 1.4e-3. A switch of two minima that was 40 s off left
# 2.5e-3, at a loss of 2e-4 of the objective.
_BALANCED = 2e-3


def held_switches(iterate: Iterate, index: int, jumps: Sequence[Jump]) -> Flags:
    """Whether a switch is held at inner breakpoints, by where jumps were located, (N - 1,)."""
    inner = iterate.trajectory.phases[index].fractions[1:-1]
    located = _near(inner, np.array([jump.at for jump in jumps]))
    return _fixed_breakpoints(iterate, index) & located


def missed_switches(
    iterate: Iterate, evaluator: Evaluator, index: int, jumps: Sequence[Jump]
) -> Array:
    """Estimated gain by other times of held switches, by jumps of the Hamiltonian, (N - 1,).

    For each inner breakpoint, relative to the objective. It is 0 where no switch is held, and for
    schemes whose multipliers do not tell.
    """
    held = held_switches(iterate, index, jumps)
    if not (held.any() and iterate.scheme.informative_multipliers):
        return np.zeros(held.size)

    gained = shifts(iterate, evaluator, index) / iterate.objective_size
    return np.where(held & (gained >= _MISSED), gained, 0.0)


def displaced_switches(iterate: Iterate, evaluator: Evaluator, index: int) -> Flags:
    """Whether a held switch is displaced, by a jump of the Hamiltonian there, (N - 1,).

    At the right time of a switch the Hamiltonian is the same on both sides. Beside a narrow
    interval its jump shows little, however far off the switch is. None where expressions of
    the statement jump: the Hamiltonian may jump there by itself. None in a phase that takes no
    time: its controls matter for nothing, and neither do their switches.
    """
    held = _held_by_sides(iterate, index)
    informative = iterate.scheme.informative_multipliers and not iterate.takes_no_time(index)
    if not (held.any() and informative) or iterate.problem.is_discontinuous:
        return np.zeros_like(held)
    return held & (relative_jumps(iterate, evaluator, index) > _BALANCED)


def beside(breakpoints: Flags) -> Flags:
    """Whether intervals begin or end at one of some inner breakpoints (N - 1,), shape (N,)."""
    ends = np.concatenate([[False], breakpoints, [False]])
    return np.asarray(ends[:-1] | ends[1:])


def shared(missed: Array) -> Array:
    """Estimated gain by moving inner breakpoints (N - 1,), half of it for each side, (N,)."""
    halves = np.concatenate([[0.0], 0.5 * missed, [0.0]])
    return np.asarray(halves[:-1] + halves[1:])


def _fixed_breakpoints(iterate: Iterate, index: int) -> Flags:
    """Whether inner breakpoints neither move nor stand at a known time, (N - 1,)."""
    motion, mesh = iterate.trajectory.phases[index], iterate.mesh.phases[index]
    known = motion.fractions_of(iterate.problem.instants[motion.name])
    moving = np.isin(np.arange(1, motion.intervals), mesh.movable)
    return ~_near(motion.fractions[1:-1], known) & ~moving


def _held_by_sides(iterate: Iterate, index: int) -> Flags:
    """Whether a switch is held at inner breakpoints, by the controls on both sides, (N - 1,).

    A control may go on rising behind its step, so that the jump is located inside an interval, and
    `held_switches` does not have it.
    """
    switches = switches_at_breakpoints(iterate.trajectory.phases[index], iterate.scales.signals)
    return _fixed_breakpoints(iterate, index) & switches


def _near(inner: Array, places: Array) -> Flags:
    """Whether one of some places (m,) is at inner breakpoints (N - 1,), shape (N - 1,)."""
    off = np.abs(inner[:, None] - places).min(axis=1, initial=np.inf)
    return np.asarray(off <= SAME_POINT)


# Added points that an interval may hold before it is split instead. Where the control is smooth a
# violation goes by more points: each split would make new ones.
_MOST_EXTRA_WHERE_ROUGH = 4
_MOST_EXTRA = 10

# relative excess beyond which an interval is too long for its constraint: a solver leaps between
# the added points over a ridge as steep as that
_COARSE = 1e-4

# Of the phase: in an interval this narrow a violation is removed without a cut, however large it
# is. Where a control has a pole, as at the dead point of a mechanism, each half of a cut is off by
# as much as the whole, and the objective no longer notices.
NARROW = 1e-4


@dataclass(frozen=True, eq=False, repr=False)
class PhaseErrors:
    """Errors of one phase of a solved mesh, per interval.

    Attributes
    ----------
    dynamics : (N,)
        Relative errors of the dynamics, the integrals and the equations.
    gain : (N,)
        What a better mesh could gain, relative to the objective, to first order. It is the sum of
        what finer controls could gain where they are rough, of what other breakpoints could where
        a path constraint acts, and of what backed-off limits cost.
    switching : (N,)
        What finer controls could gain, rough or not.
    displaced : (N - 1,)
        Whether a control switches at a fixed inner breakpoint, and should do so at another time by
        the Hamiltonian.
    excess : tuple of Extremes
        Excess of each path constraint, relative to its size on the trajectory.
    jumps : tuple of Jump
        Jumps of the controls.
    crowded : (N,)
        Whether a constraint is exceeded although several added points hold it already.
    coarse : (N,)
        Whether one is exceeded by so much that the interval is too long for it.
    parts : (N,)
        In how many a smooth control is resolved, a real number.
    at_end : (N,)
        Whether most of what finer controls could gain is near the end of an interval that has no
        jump of a control.
    crossings : KinkCrossings
        Where the motion goes through kinks.
    """

    dynamics: Array
    gain: Array
    switching: Array
    displaced: Flags
    excess: tuple[Extremes, ...]
    jumps: tuple[Jump, ...]
    crowded: Flags
    coarse: Flags
    parts: Array
    at_end: Flags
    crossings: KinkCrossings


@dataclass(frozen=True, eq=False, repr=False)
class MeshErrors:
    """Errors of a solved mesh between its points.

    Attributes
    ----------
    phases : tuple of PhaseErrors
    dynamics : float
        Largest error of the dynamics.
    excess : float
        Largest excess of a path constraint; 0 where there is none.
    gain : float
        What finer controls could still gain, relative to the objective, to first order, the cost of
        back-offs included.
    of_motion : MotionErrors or None
        Those of the motion alone.
    """

    phases: tuple[PhaseErrors, ...] = field(repr=False)
    dynamics: float
    excess: float
    gain: float
    of_motion: MotionErrors | None = field(default=None, repr=False)

    @property
    def farthest_crossing(self) -> float:
        """How far a crossing of a kink is from a breakpoint at most, as a fraction of its phase."""
        return max(phase.crossings.farthest for phase in self.phases)

    @property
    def beyond_kinks(self) -> float:
        """The same where the mesh gives sides, which then act beyond their kinks; 0 elsewhere."""
        return max(p.crossings.farthest if p.crossings.given else 0.0 for p in self.phases)


def estimate_errors(iterate: Iterate, evaluator: Evaluator, accuracy: Accuracy) -> MeshErrors:
    """Evaluate a solved mesh between its points."""
    motion_errors = MotionErrors(
        iterate.transcription, iterate.trajectory, evaluator, iterate.parameters
    )
    strongest = strongest_multipliers(iterate)
    phases = []

    for index, motion in enumerate(iterate.trajectory.phases):
        jumps = tuple(control_jumps(motion, iterate.scales.signals))
        gains = PhaseGains.of(iterate, evaluator, index, strongest[index])
        missed = shared(missed_switches(iterate, evaluator, index, jumps))
        acting = strongest[index] > ACTING
        on_arcs = arc_gains(iterate, evaluator, index, acting) / iterate.objective_size
        excess = without_small_costs(
            iterate, index, motion_errors.excess[index], accuracy.objective
        )
        excess = weighted_by_effect(iterate, index, excess, accuracy)
        over = [e.values > _COARSE for e in excess]
        wide = np.diff(motion.fractions) > NARROW
        phases.append(
            PhaseErrors(
                dynamics=motion_errors.dynamics[index],
                gain=gains.counted + missed + on_arcs,
                switching=gains.anywhere + missed,
                displaced=displaced_switches(iterate, evaluator, index),
                excess=excess,
                jumps=jumps,
                crowded=wide
                & _crowded(iterate.mesh.extra[index], excess, gains.informative, accuracy.path),
                coarse=wide & np.any([np.zeros_like(wide), *over], axis=0),
                parts=gains.parts,
                at_end=gains.at_end & ~_at_jumps(motion, jumps),
                crossings=kink_crossings(
                    iterate.trajectory, evaluator, motion.name, iterate.mesh.phases[index].sides
                ),
            )
        )
    return MeshErrors(
        phases=tuple(phases),
        dynamics=motion_errors.worst_dynamics,
        excess=max((float(e.values.max()) for p in phases for e in p.excess), default=0.0),
        gain=sum(float(phase.gain.sum()) for phase in phases),
        of_motion=motion_errors,
    )


def _at_jumps(motion: PhaseTrajectory, jumps: Sequence[Jump]) -> Flags:
    """Whether a jump of a control is in an interval or at its ends, (N,)."""
    begins, ends = motion.fractions[:-1], motion.fractions[1:]
    found = [(ends >= jump.first) & (begins <= jump.last) for jump in jumps]
    return np.any([np.zeros_like(begins, dtype=bool), *found], axis=0)


def _crowded(
    extra: Sequence[ExtraPoints], excess: Sequence[Extremes], rough: Flags, tolerance: float
) -> Flags:
    """Intervals in which further added points would not do."""
    crowded = np.zeros(rough.size, dtype=bool)
    most = np.where(rough, _MOST_EXTRA_WHERE_ROUGH, _MOST_EXTRA)
    for points in extra:
        held = np.bincount(points.intervals, minlength=rough.size)
        over = excess[points.constraint].values > tolerance
        crowded |= (held > most) & over
    return crowded
