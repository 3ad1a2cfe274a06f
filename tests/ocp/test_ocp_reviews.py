"""Reviews of an answer: when they are asked, and what becomes of former answers."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from ocp import Control, Phase, Problem, Settings, Solution, State, solve
from ocp.refinement.reviews.finding import Candidate, Former, Found, Onward, Review

Reviewed = Callable[..., Solution]


def _least_effort() -> Problem:
    """A unit mass over a unit length in a unit of time, from rest to rest: 12 by calculus."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("move", {x: v, v: u}, {x: 0.0, v: 0.0}, {x: 1.0, v: 0.0}, end=1.0)
    return Problem("least effort", phase, minimise=phase.integral(u**2))


@pytest.fixture
def reviewed(monkeypatch: pytest.MonkeyPatch) -> Reviewed:
    """A solve with these reviews, each of which may lead onward so often."""

    def solved(*reviews: tuple[Review, int], settings: Settings | None = None) -> Solution:
        monkeypatch.setattr("ocp.refinement.refine._REVIEWS", reviews)
        return solve(_least_effort(), settings=settings)

    return solved


def _onward(answer: Candidate, former: Former = "as good") -> Onward:
    iterate = answer.best.iterate
    return Onward(iterate, iterate.mesh, former)


def test_all_reviews_are_asked_again_about_another_answer(reviewed: Reviewed) -> None:
    asked: list[str] = []

    def content(answer: Candidate) -> Found:
        asked.append("content")
        return Found()

    def finds_once(answer: Candidate) -> Found:
        asked.append("finds once")
        return Found(_onward(answer)) if len(asked) == 2 else Found()

    answer = reviewed((content, 3), (finds_once, 3))
    assert asked == ["content", "finds once", "content", "finds once"]
    assert answer.objective == pytest.approx(12.0, rel=1e-9)


@pytest.mark.parametrize("most", [0, 1, 3])
def test_a_review_that_always_finds_something_leads_onward_so_often(
    reviewed: Reviewed, most: int
) -> None:
    once = len(reviewed().mesh_iterations)

    def never_content(answer: Candidate) -> Found:
        return Found(_onward(answer))

    answer = reviewed((never_content, most))
    assert len(answer.mesh_iterations) == once + most
    assert answer.verification.passed


@pytest.mark.parametrize("former", ["as good", "coarser", "none"])
def test_former_answers_are_kept_where_they_are_as_good(reviewed: Reviewed, former: Former) -> None:
    known: list[int] = []

    def finds_once(answer: Candidate) -> Found:
        known.append(len(answer.history.solved))
        return Found(_onward(answer, former)) if len(known) == 1 else Found()

    reviewed((finds_once, 1))
    first, second = known
    assert second == (first if former == "as good" else 0) + 1


def test_a_budget_that_ends_before_a_refinement_goes_on_is_said(reviewed: Reviewed) -> None:
    def finds(answer: Candidate) -> Found:
        return Found(_onward(answer))

    whole = sum(record.iterations for record in reviewed().mesh_iterations)
    answer = reviewed((finds, 3), settings=Settings(iterations=whole))
    assert "ended the refinement" in answer.verdict
