"""The conditions of a certificate on the controls: Pontryagin's minimum principle, phase by phase.

They are those of continuous time, on `ocp.diagnostics.minimum_principle`. Those of the nonlinear
program are in `program_conditions`.
"""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca

from ocp.diagnostics.diagnostic import Evidence, Finding, Tolerances
from ocp.diagnostics.minimum_principle import MinimumPrinciple, minimum_principle
from ocp.diagnostics.other_controls import gain_of, other_controls, others_remark
from ocp.estimates.estimated_gain import estimated_gain
from ocp.optimality.active_set import ACTING, strongest_multipliers
from ocp.optimality.multipliers import duration_multiplier
from ocp.problem.functionals import BoundaryValue, End, PhaseTime
from ocp.problem.symbols import TIME, Between


def optimality_conditions(answer: Evidence) -> Iterator[Finding]:
    """The minimum principle, phase by phase, and the estimated gain of finer controls."""
    iterate, allowed = answer.iterate, answer.allowed
    informative = iterate.scheme.informative_multipliers
    strongest = strongest_multipliers(iterate)
    acting = [of_phase > ACTING for of_phase in strongest]

    for index, costates in enumerate(answer.multipliers.costates):
        principle = minimum_principle(iterate, answer.evaluator, costates, index, acting[index])
        yield from _between_changes(principle, allowed)
        yield from _on_the_whole(principle, allowed)
        yield from _end_values(answer, principle, index, allowed)
        if informative and principle.acting.any():
            yield Finding(
                f"where path constraints act in '{principle.name}': Hamiltonian",
                principle.gain_on_arcs / iterate.objective_size,
                allowed.gain,
                "the estimated improvement by other times of the breakpoints, to first order, "
                "relative to the objective",
            )

    # other schemes have multipliers that meet the principle on any mesh, see `second_solve`
    if informative:
        yield Finding(
            "finer controls",
            estimated_gain(iterate, answer.evaluator, strongest),
            allowed.gain,
            "the estimated improvement by finer controls, plus the cost of limits that were "
            "tightened to hold between the points, to first order, relative to the objective",
        )


def other_controls_condition(answer: Evidence) -> Iterator[Finding]:
    """The estimated gain by controls far from the answer's, each tried over its whole range."""
    iterate, allowed = answer.iterate, answer.allowed
    others = list(other_controls(iterate, answer.evaluator))
    yield Finding(
        "other controls",
        gain_of(others, iterate),
        allowed.gain,
        others_remark(others, iterate)
        or "the estimated improvement by other values of the controls, to first order, relative "
        "to the objective: the check tries each control over its whole range at sampled times "
        "(except where a limit of states alone is active, or where the problem is linear or "
        "convex in the controls)",
    )


def _between_changes(principle: MinimumPrinciple, allowed: Tolerances) -> Iterator[Finding]:
    """What must hold strictly where the active set does not change."""
    left_out = f"{int(principle.changes.sum())} of {principle.changes.size} intervals"
    name = principle.name

    # the Hamiltonian is constant only where time does not enter
    if principle.autonomous:
        yield Finding(
            f"between changes of '{name}': Hamiltonian",
            principle.drift_between_changes,
            allowed.within,
            "its largest difference, relative to its terms, between two intervals without a "
            "change of the active set in between, and without an active path constraint or state "
            f"bound; {left_out} contain a change or are next to one",
        )
    # there is no slope where all intervals hold a change
    if principle.slopes.size:
        yield Finding(
            f"between changes of '{name}': dH/du",
            principle.slope_between_changes,
            allowed.strict,
            "its largest interval mean in intervals without a change of the active set, projected "
            f"on the controls' bounds, relative to its terms; {left_out} contain a change or are "
            "next to one",
        )


def _on_the_whole(principle: MinimumPrinciple, allowed: Tolerances) -> Iterator[Finding]:
    """What holds in the mean over the phase, changes of the active set included."""
    if principle.autonomous:
        yield Finding(
            f"Hamiltonian of '{principle.name}'",
            principle.drift,
            allowed.hamiltonian,
            "the problem does not depend on time, so it must be constant: its mean is "
            f"{principle.mean:.8g}, with this mean drift",
        )
    if principle.slopes.size:
        yield Finding(
            f"dH/du of '{principle.name}'",
            principle.mean_slope,
            allowed.slope,
            "the mean over time of its interval means, projected on the controls' bounds, "
            "relative to their terms",
        )


def _end_values(
    answer: Evidence, principle: MinimumPrinciple, index: int, allowed: Tolerances
) -> Iterator[Finding]:
    """Transversality: ``H = -dJ/dt`` at a free final time, ``dJ/dt`` at a free initial one."""
    columns = answer.iterate.transcription.columns.phases[index]
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
        slope = answer.bound_multiplier(columns.ends[node])
        slope -= sign * duration_multiplier(answer.iterate, index)
        slope += _slope_by_time(answer, principle.name, end)
        found = principle.mean if principle.autonomous else principle.ends[node]
        yield Finding(
            f"Hamiltonian at the {end} of '{principle.name}'",
            abs(found - sign * slope) / max(principle.size, abs(slope)),
            allowed.hamiltonian,
            f"the time is free, so it must be {sign * slope:.8g}; its value is {found:.8g}",
        )


def _slope_by_time(answer: Evidence, phase: str, end: End) -> float:
    """Slope of objective, bounds and links by an end time, through the time and end values."""
    iterate, evaluator = answer.iterate, answer.evaluator
    last = iterate.trajectory.phase(phase).intervals - 1
    interval, tau = (0, 0.0) if end == "start" else (last, 1.0)

    slope = 0.0
    for functional in iterate.problem.functionals:
        if not isinstance(functional, (BoundaryValue, PhaseTime)):
            continue
        if (functional.phase, functional.end) != (phase, end):
            continue
        share = answer.slope(functional)
        if isinstance(functional, BoundaryValue):
            # the value depends on the time by itself, beside the state that moves with it
            by_time = ca.densify(ca.jacobian(functional.expression, TIME.symbol))
            values = evaluator.values(iterate.trajectory, phase, [by_time], interval, [tau])
            share *= float(values[0, 0])
        slope += share
    return slope
