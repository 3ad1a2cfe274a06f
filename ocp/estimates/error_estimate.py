"""What is wrong with a solved mesh between its points: the motion's errors, and what is lost.

The errors of the motion alone are in `motion_errors`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ocp.accuracy import Accuracy
from ocp.arrays import Array, Flags
from ocp.estimates.constrained_arcs import arc_gains
from ocp.estimates.kink_crossings import KinkCrossings, kink_crossings
from ocp.estimates.missed_switches import (
    between_valleys,
    displaced_switches,
    missed_switches,
    shared,
)
from ocp.estimates.motion_errors import MotionErrors
from ocp.estimates.promised_gain import PhaseGains, weighted_by_worth, without_small_costs
from ocp.estimates.switch_detection import Jump, control_jumps
from ocp.mesh.mesh import ExtraPoints
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory
from ocp.numerics.interval_maxima import Extremes
from ocp.optimality.active_set import ACTING, strongest_multipliers
from ocp.optimality.iterate import Iterate

# Added points that an interval may hold before it is split instead. Where the control is smooth a
# leak is closed by more points: each split would open new leaks.
_MOST_EXTRA_WHERE_ROUGH = 4
_MOST_EXTRA = 10

# relative excess beyond which an interval is too long for its constraint: a solver leaps between
# the added points over a ridge as steep as that
_COARSE = 1e-3

# Of the phase: in an interval this narrow a leak is closed without a cut, however large it is.
# Where a control has a pole, as at the dead point of a mechanism, each half of a cut leaks as much
# as the whole, and the objective no longer notices.
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
    valleys : (N - 1,)
        What other times of fixed inner breakpoints could gain, relative to the objective, where a
        control changes there from one valley of the Hamiltonian to another. Half of it is in `gain`
        on each side.
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
    valleys: Array
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
        valleys = np.zeros(max(motion.intervals - 1, 0))
        # the dearest of all estimates: not for a motion that is about to be replaced anyway
        if motion_errors.worst_dynamics <= accuracy.dynamics:
            valleys = between_valleys(iterate, evaluator, index)
        missed = shared(np.maximum(missed_switches(iterate, evaluator, index, jumps), valleys))
        acting = strongest[index] > ACTING
        on_arcs = arc_gains(iterate, evaluator, index, acting) / iterate.objective_size
        excess = without_small_costs(
            iterate, index, motion_errors.excess[index], accuracy.objective
        )
        excess = weighted_by_worth(iterate, index, excess, accuracy)
        over = [e.values > _COARSE for e in excess]
        wide = np.diff(motion.fractions) > NARROW
        phases.append(
            PhaseErrors(
                dynamics=motion_errors.dynamics[index],
                gain=gains.told + missed + on_arcs,
                switching=gains.anywhere + missed,
                valleys=valleys,
                displaced=displaced_switches(iterate, evaluator, index),
                excess=excess,
                jumps=jumps,
                crowded=wide
                & _crowded(iterate.mesh.extra[index], excess, gains.telling, accuracy.path),
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
