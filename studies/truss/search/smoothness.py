"""Smooth motions wherever the objective leaves them free, at a price that it hardly notices.

A peak says nothing of the motion below it. Many motions then have the same peak, and the solver
would wander among them. So the roughness of the motion (`studies.truss.problem.Statement`) is
minimised beside the peak, at a price.

At its first price the smoothest of all motions pays a small share of the peak. It is high enough to
lead the solver straight to an optimum. A motion that has to be rough pays more than that share.
Then the price is lowered, and the motion solved again from where it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from ocp import Interrupted, OcpError, Problem, Settings, Solution, solve
from ocp.progress import Progress
from studies.truss.config import TrussStudy
from studies.truss.limits.feasibility import end_forces
from studies.truss.limits.sizes import Sizes
from studies.truss.problem import Statement
from studies.truss.quantities import OBJECTIVES
from studies.truss.search.verdict import BOUND_MET

# Share of the peak that the roughness may have in what is minimised. It is no bound on what the
# roughness adds to the peak: an optimum that is rougher than what was found would pay more.
SHARE = 2e-5

# The same of the work, which tells one slow motion from another so little that less is enough.
_SHARE_OF_WORK = 2e-6

# The same with an arm, where no lower price is tried afterwards: at a hundred times of it a least
# momentum at the root, whose motion is rough, was 0.4 % too high.
_SHARE_WITH_ARM = 3e-6

# What is aimed at when the price is lowered, for the motion becomes rougher with it; in how many
# steps at most; by how much at once, so that the motion before remains a good start; and how many
# iterations each may take: what succeeds takes up to about 350.
_AIM = 0.5
_STEPS = 5
_LARGEST_STEP = 1e-3
_LEAST_STEP = 0.1
_ITERATIONS = 1000

# Relative: a lower price that gains no more than this is low enough.
_NO_GAIN = 5e-6


def first_price(
    study: TrussStudy, stage: int, weights: dict[str, float], with_forces: bool
) -> float:
    """The price of the roughness that a search begins with, in units of a stage; 0 for none.

    Peaks leave the motion free elsewhere, but for the least acceleration, which is one motion
    alone. Without a cap on the jerk they leave less, and the solver needs no price, unless springs
    pull at first: then the start sets the peak, and leaves the rest free. The work of a slow motion
    hardly depends on it.

    Parameters
    ----------
    weights : dict of str to float
        References by which the objectives are divided.
    with_forces : bool
        Whether the rope force is part of the problem.
    """
    terms = study.minimise[stage]
    peaks = all(OBJECTIVES[name].kind == "peak" for name in terms)
    free = (peaks and set(terms) != {"peak-acceleration"}) or set(terms) == {"residual-energy"}
    if not study.jerk_limited:
        _, first, _ = end_forces(study)[0]
        free = set(terms) == {"energy"} or (free and with_forces and first < 0.0)
    if not study.smooth or not free:
        return 0.0

    # a share of what the peak is at least, so that it costs no larger share of the peak
    sizes = Sizes(study, study.duration[1])
    share = SHARE if study.jerk_limited else _SHARE_OF_WORK
    if study.arm is not None:
        share = _SHARE_WITH_ARM
    return share * sum(
        weight * OBJECTIVES[name].sized(sizes) / weights[name] for name, weight in terms.items()
    )


@dataclass(frozen=True, eq=False)
class Smoothed:
    """A motion and what its smoothness costs.

    Attributes
    ----------
    solution : Solution
    share : share of the peak that the roughness has in what was minimised; 0 without a price.
    interrupted : whether the user stopped the search for a cheaper one.
    """

    solution: Solution
    share: float = 0.0
    interrupted: bool = False


def share_of(statement: Statement, solution: Solution) -> float:
    """Share of the first stage that the roughness has in what was minimised."""
    if statement.price is None:
        return 0.0
    paid = solution.value(statement.price.symbol * statement.roughness)
    return paid / abs(solution.value(statement.stages[0], replayed=True))


def share_is_all(statement: Statement) -> bool:
    """Whether the share of the roughness says what its price costs: where the jerk is capped."""
    return statement.price is None or statement.signals.jerk is not None


def price_in_words(statement: Statement, solution: Solution) -> str | None:
    """What the smoothness of an answer costs; None where that is within what counts as optimal."""
    share = share_of(statement, solution)
    if share <= BOUND_MET or not share_is_all(statement):
        return None
    return (
        f"The smoothness term costs {100 * share:.2g} % of the objective: the solver found no "
        "verified motion with a smaller weight. A less smooth motion may be better. With a lower "
        "jerk cap the optimum is unique."
    )


def at_a_light_price(
    problem: Problem,
    statement: Statement,
    solution: Solution,
    settings: Settings,
    left: Callable[[], float],
    progress: Progress | bool | None,
) -> Smoothed:
    """Lower the price of the roughness until its share is small; never a loss.

    An acceleration that may jump can be as rough as it likes, and the share then says little of
    what the price costs: it is lowered until that gains nothing more.

    Parameters
    ----------
    left : callable
        Gives what is left of the seconds that the search may take.
    """
    best = Smoothed(solution, share_of(statement, solution))
    gain = 0.0 if share_is_all(statement) else math.inf
    largest = _LARGEST_STEP
    for _ in range(_STEPS):
        if best.share <= SHARE and gain <= _NO_GAIN:
            break
        assert statement.price is not None
        price = best.solution.value(statement.price.symbol)
        step = min(max(_AIM * SHARE / best.share, largest), _LEAST_STEP)
        price *= step
        try:
            lighter = solve(
                problem,
                settings=replace(settings, iterations=_ITERATIONS, seconds=left()),
                guess=best.solution,
                constants={statement.price: price},
                progress=progress,
                partial=False,
            )
        except Interrupted:
            return replace(best, interrupted=True)
        except OcpError:
            if step == _LEAST_STEP:
                break
            largest = _LEAST_STEP  # so far at once leads astray
            continue

        before, after = (
            found.value(statement.stages[0], replayed=True) for found in (best.solution, lighter)
        )
        if after > before:
            break
        best, gain = Smoothed(lighter, share_of(statement, lighter)), 1.0 - after / before
    return best
