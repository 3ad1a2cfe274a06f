"""Objectives after the first one, each with the earlier ones held."""

from __future__ import annotations

from collections.abc import Mapping

from ocp import Lexicographic, Settings, Solution, solve_lexicographic
from studies.common.console import Console
from studies.truss.config import TrussStudy
from studies.truss.motions.deployment import Deployment
from studies.truss.problem import Statement
from studies.truss.quantities import OBJECTIVES
from studies.truss.search.smoothness import first_price


def later_stages(
    study: TrussStudy,
    statement: Statement,
    solution: Solution,
    weights: dict[str, float],
    with_forces: bool,
    settings: Settings,
    console: Console,
) -> tuple[Lexicographic, list[str]]:
    """What comes of the later objectives, which is never a loss, and what to say of it.

    Parameters
    ----------
    statement, solution : of the first objective.
    weights : references by which the objectives are divided.
    with_forces : whether the rope force is part of the problem.
    """
    rough = 0.0 if statement.roughness is None else statement.roughness
    found = solve_lexicographic(
        statement.problem(),
        statement.stages,
        slack=study.concession,
        first=solution,
        beside=[
            rough * first_price(study, place, weights, with_forces)
            for place in range(len(statement.stages))
        ],
        settings=settings,
        progress=console.live,
    )

    remarks = []
    for place, level in enumerate(found.levels, start=1):
        label = f"objective {place}"
        if level.solution is not None and place > 1:
            console.progress(f"{label}: done")
            if level.room > 0.0:
                remarks.append(
                    f"The {label} was found from above: at this optimum it may be less by "
                    f"{100 * level.room:.2g} % at most."
                )
        elif level.error is not None and not found.interrupted:
            remarks.append(f"The stage '{label}' failed and was left out: {level.error}")
    return found, remarks


def in_order_in_words(
    study: TrussStudy, found: Lexicographic, first: float, deployment: Deployment
) -> str:
    """The objectives in their order and the part of the concession that was used, for the verdict.

    Parameters
    ----------
    found : what came of the later objectives.
    first : least value of the first objective, as `Solution.value` gives it.
    deployment : the motion that was found.
    """
    stages = reached(study, found)
    if len(stages) < 2:
        return ""
    listed = ", then ".join(_valued(stage, deployment) for stage in stages)
    used = found.solution.value(found.levels[0].objective, replayed=True) / first - 1.0
    share = used / study.concession if study.concession > 0.0 else 0.0
    return (
        f"; in order: {listed}, with {100 * max(used, 0.0):.2g} % conceded by the first "
        f"({100 * max(share, 0.0):.0f} % of the concession of {100 * study.concession:.2g} %)"
    )


def reached(study: TrussStudy, found: Lexicographic) -> list[Mapping[str, float]]:
    """The objectives that were minimised, in their order; the last one is that of the motion."""
    solved = sum(level.solution is not None for level in found.levels)
    return list(study.minimise[:solved])


def _valued(stage: Mapping[str, float], deployment: Deployment) -> str:
    """An objective with its value; a weighted sum by its parts."""
    return " and ".join(
        f"{OBJECTIVES[name].title} {deployment.values[name]:.6g} {OBJECTIVES[name].unit}"
        for name in stage
    )
