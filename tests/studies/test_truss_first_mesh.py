"""Starts that are not refined to the end: one that ends where another does, and one cut short."""

from __future__ import annotations

import dataclasses
from functools import partial

from ocp import Accuracy, audit, solve
from studies.common.console import silent
from studies.truss.config import SolverOptions, TrussStudy
from studies.truss.limits.caps import Caps
from studies.truss.search.first_mesh import ends_alike
from studies.truss.search.question import Question
from studies.truss.search.verdict import cut_short_in_words

ROUGH = Accuracy(objective=1e-2, path=1e-2, dynamics=1e-2)


def test_a_start_that_ends_alike_has_the_motion_of_the_other_one() -> None:
    study = TrussStudy(
        minimise="peak-force",
        duration=20.0,
        caps=Caps(jerk="2000/T^3"),
        solver=SolverOptions(intervals=20),
    )
    question = Question(study, silent(), accuracy=ROUGH)
    bezier, dwell = (partial(question.problem_from_start, name) for name in ("bezier", "dwell"))
    assert ends_alike(question, "bezier", bezier, []) is None
    found = audit(
        starts={"bezier": bezier}, settings=question.settings, value=question.statements.value
    )

    alike = ends_alike(question, "dwell", dwell, found.trials)
    assert alike is not None
    assert alike.name == "dwell"
    assert alike.solution is found.trials[0].solution
    assert alike.value == found.trials[0].value

    # with friction in the pulleys the static force is twice as large
    rubbed = dataclasses.replace(study.truss, pulley_friction=0.01)
    other = Question(dataclasses.replace(study, truss=rubbed), silent(), accuracy=ROUGH)
    dwell = partial(other.problem_from_start, "dwell")
    assert ends_alike(other, "dwell", dwell, found.trials) is None


def test_a_motion_whose_budget_ended_says_what_may_be_left() -> None:
    study = TrussStudy(minimise="peak-rope-acceleration", duration=20.0, caps=Caps(jerk="200/T^3"))
    question = Question(study, silent())
    problem = question.problem_from_start("bezier")
    whole = solve(problem, settings=question.settings)
    assert cut_short_in_words(whole) is None
    first, second, *_ = whole.mesh_iterations
    budget = first.iterations + second.iterations
    cut = solve(problem, settings=dataclasses.replace(question.settings, iterations=budget))
    assert f"ended the refinement, at an accuracy of {cut.accuracy:.1e}" in cut_short_in_words(cut)
