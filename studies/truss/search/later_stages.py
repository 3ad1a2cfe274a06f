"""Objectives after the first one, each with the earlier ones held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ocp import Lexicographic, Solution, solve_lexicographic
from studies.common.console import number
from studies.common.finished import mark
from studies.truss.config import TrussStudy
from studies.truss.problem import Statement
from studies.truss.quantities import OBJECTIVES
from studies.truss.search.question import Question
from studies.truss.search.smoothness import first_price


def later_stages(
    question: Question, statement: Statement, solution: Solution
) -> tuple[Lexicographic, list[str]]:
    """What comes of the later objectives, which is never a loss, and what to say of it.

    Parameters
    ----------
    statement, solution : of the first objective.
    """
    study, console = question.study, question.console
    rough = 0.0 if statement.roughness is None else statement.roughness
    found = question.kept.step(
        "later objectives",
        lambda: solve_lexicographic(
            statement.problem(),
            statement.stages,
            slack=study.concession,
            first=solution,
            beside=[
                rough * first_price(study, place, question.weights, question.with_forces)
                for place in range(len(statement.stages))
            ],
            settings=replace(question.settings, seconds=question.some_left()),
            progress=console.live,
        ),
        solution.problem,
        console.progress,
        begins_with=mark(solution),
        done=lambda new: not new.interrupted and all(level.error is None for level in new.levels),
    )

    remarks = []
    for place, level in enumerate(found.levels, start=1):
        label = f"objective {place}"
        if level.solution is not None and place > 1:
            console.progress(f"{label}: done")
            if level.gap > 0.0:
                remarks.append(
                    f"The {label} found is an upper bound: its minimum at this optimum may be up "
                    f"to {100 * level.gap:.2g} % smaller."
                )
        elif level.error is not None and not found.interrupted:
            remarks.append(f"The objective '{label}' failed and was left out: {level.error}")
    return found, remarks


def in_order(study: TrussStudy, found: Lexicographic) -> str:
    """What the later objectives reached, and how much of each concession they used, in words."""
    reached = [level for level in found.levels if level.solution is not None]
    words = []
    for place, level in enumerate(reached):
        value = found.solution.value(level.objective, replayed=True)
        title, unit = _named(study.minimise[place])
        if place > 0:
            words.append(f"then {title} {number(value, 6)} {unit}")
        if place < len(reached) - 1:
            assert level.value is not None
            assert level.held is not None
            used = max(value - level.value, 0.0) / (level.held - level.value)
            words.append(
                f"to improve the later objectives, the {title} rises from {number(level.value, 6)} "
                f"to {number(value, 6)} {unit}, which is {100 * used:.0f} % of the allowed "
                f"concession ({100 * study.concession:g} %)"
            )
    return "; ".join(words[1:] + words[:1])


def _named(stage: Mapping[str, float]) -> tuple[str, str]:
    """Title and unit of a stage."""
    if len(stage) == 1:
        quantity = OBJECTIVES[next(iter(stage))]
        return quantity.title, quantity.unit
    return f"weighted sum of {' and '.join(stage)}", "1"
