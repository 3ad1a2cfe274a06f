"""The price of smoothness: how it is lowered, and what is said of what is left."""

from dataclasses import replace

import pytest

from ocp import Accuracy, AdaptiveMesh, Settings, SolveFailed, solve
from studies.common.console import silent
from studies.truss.config import study_from
from studies.truss.search import smoothness
from studies.truss.search.question import Question
from studies.truss.search.smoothness import SHARE, at_a_light_price, price_in_words, share_of

# the share of the price is the same to three digits on finer meshes
COARSE = Settings(
    intervals=20, accuracy=Accuracy(objective=1e-4), refinement=AdaptiveMesh(rounds=6)
)
ROUGH = study_from({"minimise": "peak-force", "duration": 4.0, "caps": {"jerk": 6.0}})


@pytest.fixture(scope="module")
def priced():
    """The problem, its statement and a first motion at its first price."""
    question = Question(ROUGH, silent(), rope_pulls=True)
    problem = question.problem_from_start("bezier")
    return problem, question.statements.of[problem], solve(problem, settings=COARSE)


@pytest.mark.slow
def test_a_step_that_leads_astray_is_followed_by_a_smaller_one(priced, monkeypatch):
    problem, statement, first = priced
    before = first.value(statement.price.symbol)
    steps = []

    def first_fails(problem, *, settings, guess, constants, progress, partial):
        steps.append(constants[statement.price] / guess.value(statement.price.symbol))
        if len(steps) == 1:
            raise SolveFailed("astray", None)
        return solve(
            problem, settings=replace(COARSE, seconds=60.0), guess=guess, constants=constants
        )

    share = share_of(statement, first)
    assert 0.1 * share > 0.5 * SHARE  # a step of more than a factor of ten is tried first
    monkeypatch.setattr(smoothness, "solve", first_fails)
    found = at_a_light_price(problem, statement, first, COARSE, lambda: 60.0, None)
    assert steps[0] < 0.1
    assert steps[1] == pytest.approx(0.1)
    assert found.solution.value(statement.price.symbol) < before
    peak = statement.stages[0]
    assert found.solution.value(peak, replayed=True) < first.value(peak, replayed=True)


@pytest.mark.slow
def test_a_price_that_is_left_is_said(priced):
    problem, statement, first = priced
    share = share_of(statement, first)
    assert share > 1e-4
    assert f"{100 * share:.2g} %" in price_in_words(statement, first)

    light = solve(
        problem,
        settings=COARSE,
        guess=first,
        constants={statement.price: 1e-5 / share * first.value(statement.price.symbol)},
    )
    assert share_of(statement, light) < 1e-4
    assert price_in_words(statement, light) is None
