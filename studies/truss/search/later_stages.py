"""Objectives after the first one, each with the earlier ones held."""

from __future__ import annotations

from ocp import Lexicographic, Settings, Solution, solve_lexicographic
from studies.common.console import Console
from studies.truss.config import TrussStudy
from studies.truss.problem import Statement
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
