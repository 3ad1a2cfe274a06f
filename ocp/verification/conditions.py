"""What a condition of a certificate is and is tested on, and the conditions on the motion.

Each group of conditions is a function that yields them: the replayed motion against the statement
(`motion_conditions`), the minimum principle (`optimality_conditions`) and steps that no derivative
shows (`step_conditions`). Those on the nonlinear program are in `program_conditions`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.mesh.trajectory import Evaluator
from ocp.optimality.active_set import ACTING, strongest_multipliers
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import Multipliers, duration_multiplier
from ocp.optimality.number_steps import number_remark, number_steps
from ocp.optimality.steps import step_remark, steps_along
from ocp.problem.functionals import BoundaryValue, End, Functional, Peak, PhaseTime
from ocp.problem.symbols import TIME, Between, Constant
from ocp.refinement.accuracy import Accuracy
from ocp.refinement.estimates.error_estimate import MotionErrors
from ocp.refinement.estimates.excess_price import worth_of_excess
from ocp.refinement.estimates.missed_slopes import missed_slopes
from ocp.refinement.estimates.narrow_features import feature_remark, narrow_features
from ocp.refinement.estimates.promised_gain import promised_gain
from ocp.refinement.estimates.switch_detection import control_jumps
from ocp.refinement.other_controls.promise import other_controls, others_remark, promised_by
from ocp.verification.far_origins import WITHIN
from ocp.verification.minimum_principle import MinimumPrinciple, minimum_principle
from ocp.verification.simulation import SimulatedMotion, replayed, simulate
from ocp.verification.tolerances import Tolerances
from ocp.verification.verify import boundary_excesses, verify

# Fraction of a phase within which a jump is on a breakpoint
_ON_BREAKPOINT = 1e-9

# Part of its scale that is the size of a peak of zero, as of an objective that is zero
_OF_A_SCALE = 1e-3


@dataclass(frozen=True)
class Condition:
    """One number, what it may be at most, and what it means."""

    name: str
    value: float
    tolerance: float
    sentence: str

    @property
    def passed(self) -> bool:
        """Whether the value is a number within its tolerance."""
        return bool(self.value <= self.tolerance)

    def __str__(self) -> str:
        return (
            f"{'pass' if self.passed else 'FAIL'}  {self.name}: {self.value:.1e} of "
            f"{self.tolerance:.0e} allowed; {self.sentence}"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Evidence:
    """What the conditions are tested on.

    Attributes
    ----------
    iterate : Iterate
        With the trajectory and the objective that the solution shows.
    multipliers : Multipliers
        As the solution shows them.
    scaled : (rows + n,)
        Scaled multipliers of the rows, then of the unknowns' bounds.
    """

    iterate: Iterate
    multipliers: Multipliers
    scaled: Array
    evaluator: Evaluator

    @property
    def peaks(self) -> dict[Peak, float]:
        """Values of the peaks as the solution shows them."""
        return self.iterate.trajectory.peaks_of(self.iterate.problem)

    def bound_multiplier(self, column: int) -> float:
        """Multiplier of the bound of an unknown [unit of the objective / unit of the unknown]."""
        multiplier = self.scaled[self.iterate.row_multipliers.size + column]
        size = self.iterate.transcription.columns.sizes[column]
        return float(multiplier * self.iterate.scales.objective / size)

    def slope(self, functional: Functional) -> float:
        """Slope by a functional of the objective with the bounds and links adjoined to it."""
        problem = self.iterate.problem
        total = problem.objective
        for bound in problem.boundary_constraints:
            total = total + self.multipliers.boundary[bound.name] * bound.expression
        by_functional = ca.densify(ca.jacobian(total, functional.symbol))
        return self.evaluator.number(self.iterate.trajectory, by_functional, self.peaks)


def motion_conditions(evidence: Evidence, allowed: Tolerances) -> Iterator[Condition]:
    """The replayed motion against the statement."""
    iterate, evaluator = evidence.iterate, evidence.evaluator
    simulated = simulate(iterate.problem, iterate.trajectory, iterate.scales.signals)
    replay = replayed(iterate.trajectory, simulated)
    verification = verify(iterate, simulated, replay, Accuracy(), evaluator)

    yield Condition("replay", simulated.miss, allowed.replay, _replay_words(simulated))
    yield Condition(
        "path constraints",
        verification.excess,
        allowed.excess,
        "the replayed motion exceeds a path constraint, bound or peak between the points by this "
        "part of its size",
    )
    for peak, (name, stated, dense) in zip(iterate.problem.peaks, verification.peaks, strict=True):
        # a peak of zero has the size of what it might be
        size = max(abs(stated), _OF_A_SCALE * iterate.scales.functionals[peak])
        yield Condition(
            f"peak '{name}'",
            abs(dense - stated) / size,
            allowed.excess,
            f"its largest value on the replayed motion is {dense:.8g}, reported as {stated:.8g}",
        )
    yield Condition(
        "objective",
        abs(verification.replayed_objective - iterate.objective) / iterate.objective_size,
        allowed.objective,
        "the replayed motion has an objective that differs by this part",
    )

    between_points = MotionErrors(
        iterate.transcription, iterate.trajectory, evaluator, iterate.parameters
    )
    yield Condition(
        "worth of the excess",
        worth_of_excess(iterate, between_points.excess),
        allowed.objective,
        "the motion exceeds its path constraints, bounds and peaks between the points by what is "
        "worth this part of the objective, to first order",
    )

    features = list(narrow_features(between_points, allowed.replay))
    if remark := feature_remark(features):
        largest = max(feature.size for feature in features)
        yield Condition("narrow features", largest, allowed.replay, remark)
    for far in verification.far_origins:
        name = f"displacement of '{far.state}' in '{far.phase}'"
        yield Condition(name, far.error, WITHIN, far.sentence)
    slopes = missed_slopes(iterate, evaluator, allowed.gain)
    hidden = [slope.feature for slope in slopes if not isinstance(slope.symbol, Constant)]
    if remark := feature_remark(hidden):
        largest = max(feature.size for feature in hidden)
        yield Condition("narrow features that a zero hides", largest, allowed.gain, remark)

    # bounds and links of the problem, with the peaks of the replay as they are between the points
    dense_peaks = (dense for _, _, dense in verification.peaks)
    peaks = dict(zip(iterate.problem.peaks, dense_peaks, strict=True))
    excesses = dict(boundary_excesses(iterate, replay, evaluator, peaks))
    exceeded = [f"'{name}'" for name, excess in excesses.items() if not excess <= allowed.bounds]
    yield Condition(
        "problem bounds",
        float(np.max([0.0, *excesses.values()])),
        allowed.bounds,
        f"the replayed motion does not meet {', '.join(exceeded)}"
        if exceeded
        else "the replayed motion meets all bounds and links up to this part of their sizes",
    )


def _replay_words(simulated: SimulatedMotion) -> str:
    begin = "the initial state"
    if simulated.restarts:
        begin += f" and {simulated.restarts} restarts (the motion amplifies too much for one run)"
    return (
        f"the controls, replayed by another integrator from {begin}, miss the end state by this "
        f"part of its size; errors of the states grow up to {simulated.amplification:.1e} times"
    )


def optimality_conditions(evidence: Evidence, allowed: Tolerances) -> Iterator[Condition]:
    """The minimum principle, phase by phase."""
    iterate, informative = evidence.iterate, evidence.iterate.scheme.informative_multipliers
    strongest = strongest_multipliers(iterate)
    acting = [of_phase > ACTING for of_phase in strongest]

    for index, costates in enumerate(evidence.multipliers.costates):
        principle = minimum_principle(iterate, evidence.evaluator, costates, index, acting[index])
        yield from _between_changes(principle, allowed)
        yield from _on_the_whole(principle, _undetermined_jumps(iterate, index), allowed)
        yield from _end_values(evidence, principle, index, allowed)
        if informative and principle.acting.any():
            yield Condition(
                f"where path constraints act in '{principle.name}': Hamiltonian",
                principle.gain_on_arcs / iterate.objective_size,
                allowed.gain,
                "what moving breakpoints promises to gain by its changes, to first order, relative "
                "to the objective",
            )

    # other schemes have multipliers that meet the principle on any mesh, see `finer_mesh`
    if informative:
        yield Condition(
            "finer controls",
            promised_gain(iterate, evidence.evaluator, strongest),
            allowed.gain,
            "what they promise to gain, to first order, relative to the objective",
        )
    others = list(other_controls(iterate, evidence.evaluator))
    yield Condition(
        "other controls",
        promised_by(others, iterate),
        allowed.gain,
        others_remark(others, iterate)
        or "what controls far from these promise to gain, to first order, relative to the "
        "objective; each was tried over its whole range, where no limit of states alone acts",
    )


def step_conditions(evidence: Evidence, allowed: Tolerances) -> Iterator[Condition]:
    """Steps of the expressions, whose share in the costates the program does not have."""
    iterate = evidence.iterate
    steps = list(steps_along(iterate.problem, iterate.trajectory, evidence.evaluator))
    if remark := step_remark(steps):
        size = max(step.size for step in steps if step.unseen)
        yield Condition("steps", size, allowed.steps, remark)
    beside = list(number_steps(iterate, evidence.evaluator))
    if remark := number_remark(beside):
        size = max(step.size for step in beside)
        yield Condition("steps beside the motion", size, allowed.steps, remark)


def _between_changes(principle: MinimumPrinciple, allowed: Tolerances) -> Iterator[Condition]:
    """What must hold strictly where the active set does not change."""
    count, name = int(principle.changes.sum()), principle.name

    # where changes take most of the time, the rest says little
    yield Condition(
        f"active-set changes of '{name}'",
        principle.share_judged_by_means(allowed.within, allowed.strict),
        allowed.changes,
        f"{count} of {principle.changes.size} intervals hold a change of the active set or are "
        "next to one; those that miss the strict limits take this part of the duration and are "
        "judged by means",
    )

    # the Hamiltonian is constant only where time does not enter
    if principle.autonomous:
        yield Condition(
            f"between changes of '{name}': Hamiltonian",
            principle.drift_between_changes,
            allowed.within,
            "its largest difference, relative to its terms, between two intervals of a run without "
            "changes of the active set, where no path constraint or state's bound acts",
        )
    # there is no slope where all intervals hold a change, and no curvature at the bounds
    if principle.slopes.size:
        yield Condition(
            f"between changes of '{name}': dH/du",
            principle.slope_between_changes,
            allowed.strict,
            "the worst interval mean of those without changes of the active set, projected on the "
            "controls' bounds, relative to its terms",
        )
        if np.isfinite(principle.concavity):
            yield Condition(
                f"curvature of '{name}'",
                principle.concavity,
                allowed.concave,
                "the Hamiltonian is nowhere concave in a control off its bounds, so that the "
                "motion is no maximum of what is minimised",
            )


def _on_the_whole(
    principle: MinimumPrinciple, remark: str, allowed: Tolerances
) -> Iterator[Condition]:
    """What holds in the mean over the phase, changes of the active set included."""
    if principle.autonomous:
        yield Condition(
            f"Hamiltonian of '{principle.name}'",
            principle.drift,
            allowed.hamiltonian,
            f"time does not enter, so it is constant: {principle.mean:.8g} with this mean drift"
            + remark,
        )
    if principle.slopes.size:
        yield Condition(
            f"dH/du of '{principle.name}'",
            principle.mean_slope,
            allowed.slope,
            "the interval means, projected on the controls' bounds, relative to their terms: mean "
            "over time",
        )


def _undetermined_jumps(iterate: Iterate, index: int) -> str:
    """Where the multipliers of a right answer may not be unique, in words."""
    phase = iterate.trajectory.phases[index]
    fixed = np.delete(phase.fractions, list(iterate.mesh.phases[index].movable))
    places = {jump.at for jump in control_jumps(phase, iterate.scales.signals)}

    # with a movable breakpoint on it the place of the jump is optimal, and the multipliers unique
    times = [
        f"{phase.start + place * (phase.end - phase.start):.6g} s"
        for place in sorted(places)
        if np.abs(fixed - place).min() < _ON_BREAKPOINT
    ]
    if not times:
        return ""
    return (
        f"; a control jumps on a breakpoint that does not move ({', '.join(times)}), where the "
        "multipliers need not be unique: another number of intervals tells"
    )


def _end_values(
    evidence: Evidence, principle: MinimumPrinciple, index: int, allowed: Tolerances
) -> Iterator[Condition]:
    """Transversality: ``H = -dJ/dt`` at a free final time, ``dJ/dt`` at a free initial one."""
    columns = evidence.iterate.transcription.columns.phases[index]
    if columns.ends is None:
        return
    statement = columns.phase

    sides: tuple[tuple[End, object, float], ...] = (
        ("start", statement.start, 1.0),
        ("end", statement.end, -1.0),
    )
    for node, (end, value, sign) in enumerate(sides):
        if not isinstance(value, Between):
            continue

        # the time acts through its own bounds, through what is stated of the ends, and where the
        # phase is as short as it may be
        slope = evidence.bound_multiplier(columns.ends[node])
        slope -= sign * duration_multiplier(evidence.iterate, index)
        slope += _slope_by_time(evidence, principle.name, end)
        found = principle.mean if principle.autonomous else principle.ends[node]
        yield Condition(
            f"Hamiltonian at the {end} of '{principle.name}'",
            abs(found - sign * slope) / max(principle.size, abs(slope)),
            allowed.hamiltonian,
            f"the time is free, so it is {sign * slope:.8g}; found {found:.8g}",
        )


def _slope_by_time(evidence: Evidence, phase: str, end: End) -> float:
    """Slope of objective, bounds and links by an end time, through the time and end values."""
    iterate, evaluator = evidence.iterate, evidence.evaluator
    last = iterate.trajectory.phase(phase).intervals - 1
    interval, tau = (0, 0.0) if end == "start" else (last, 1.0)

    slope = 0.0
    for functional in iterate.problem.functionals:
        if not isinstance(functional, (BoundaryValue, PhaseTime)):
            continue
        if (functional.phase, functional.end) != (phase, end):
            continue
        share = evidence.slope(functional)
        if isinstance(functional, BoundaryValue):
            # the value depends on the time by itself, beside the state that moves with it
            by_time = ca.densify(ca.jacobian(functional.expression, TIME.symbol))
            values = evaluator.values(iterate.trajectory, phase, [by_time], interval, [tau])
            share *= float(values[0, 0])
        slope += share
    return slope
