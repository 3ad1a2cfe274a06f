"""How a motion is refined: what is aimed, made lighter and made finer, on trials that cost nothing.

A trial leaves what a formula says, and its objective is one that the smoothness and the mesh raise.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from studies.arm.optimal import refinement as room
from studies.arm.optimal.refinement import AGREE, Refined, calmer, confirmed
from studies.arm.optimal.rounds import SAME, Round, refined
from studies.arm.search_limits import CALMER_ROUNDS

RESIDUAL = 1e-6


@dataclass(frozen=True)
class Trial:
    """A motion: its weight and mesh, and how often it was aimed."""

    weight: float
    intervals: int
    aims: int
    left: float
    objective: float

    @property
    def entry(self) -> Round:
        return Round(self.intervals, self.weight, self.objective, self.left)


def solver(left, objective):
    """`again` of motions that leave `left(weight, intervals, aims)`; and all that were asked."""
    asked = []

    def trial(weight, intervals, aims):
        found = Trial(
            weight,
            intervals,
            aims,
            left(weight, intervals, aims),
            objective(weight, intervals),
        )
        asked.append(found)
        return found

    def again(from_, weight, finer):
        alike = weight == from_.weight and not finer
        return trial(weight, from_.intervals * (2 if finer else 1), from_.aims + 1 if alike else 0)

    return trial(1e-4, 100, 0), again, asked


def surcharge(weight, intervals):
    return 1.0 + 0.3 * weight**0.2


def test_a_motion_without_smoothness_is_aimed_as_long_as_that_helps():
    first, again, _ = solver(lambda w, n, aims: max(1e-3 * 0.01**aims, 3e-8), lambda w, n: 0.5)
    (best, *_), rounds, change = refined(
        Trial(0.0, first.intervals, 0, first.left, 0.5), again, RESIDUAL, 100.0
    )
    assert [entry.on_full_model for entry in rounds] == pytest.approx([1e-3, 1e-5, 1e-7])
    assert (best.left, change) == (pytest.approx(1e-7), 0.0)


def test_the_smoothness_is_made_lighter_and_then_the_mesh_finer():
    first, again, asked = solver(lambda w, n, aims: 1e-8, surcharge)
    (best, *_), rounds, change = refined(first, again, RESIDUAL, 100.0)
    assert [(trial.weight, trial.intervals) for trial in asked] == [
        (1e-4, 100),
        (1e-6, 100),
        (5e-7, 200),
    ]
    assert best is asked[-1]
    assert change == pytest.approx(surcharge(5e-7, 0) / surcharge(1e-6, 0) - 1.0)
    assert len(rounds) == 3


def test_what_no_aim_takes_away_a_finer_mesh_does():
    first, again, _ = solver(
        lambda w, n, aims: 1e-7 if w > 1e-5 else (2e-5 if n == 100 else 2e-8), surcharge
    )
    (best, *_), _, _ = refined(first, again, RESIDUAL, 100.0)
    assert (best.weight, best.intervals, best.left) == (5e-7, 200, 2e-8)


def test_a_finer_motion_that_gains_more_than_a_per_cent_is_refined_again():
    first, again, _ = solver(
        lambda w, n, aims: 1e-8, lambda w, n: surcharge(w, n) * (1.0 + 200.0 / n**2)
    )
    (best, *_), _, change = refined(first, again, RESIDUAL, 100.0)
    assert best.intervals == 400
    assert abs(change) <= SAME


def test_a_motion_that_the_mesh_does_not_resolve_is_no_answer_whatever_its_objective():
    first, again, _ = solver(
        lambda w, n, aims: 1e-8 if n == 100 else 1e-2,
        lambda w, n: surcharge(w, n) if n == 100 else 0.8,
    )
    (best, *_), _, change = refined(first, again, RESIDUAL, 100.0)
    assert (best.weight, best.intervals) == (1e-6, 100)
    assert np.isnan(change)


def test_a_mesh_that_neither_leaves_a_mode_out_nor_resolves_it_is_made_finer_once_more():
    first, again, _ = solver(
        lambda w, n, aims: 1e-2 if n == 200 else 1e-8,
        lambda w, n: surcharge(w, 0),
    )
    (best, *_), _, change = refined(first, again, RESIDUAL, 100.0)
    assert (best.weight, best.intervals) == (5e-7, 400)
    assert abs(change) <= SAME


def test_a_first_mesh_that_does_not_resolve_the_motion_is_halved_before_it_is_aimed():
    first, again, asked = solver(lambda w, n, aims: 1e-2 if n == 100 else 1e-8, surcharge)
    (best, *_), _, change = refined(first, again, RESIDUAL, 100.0)
    assert (asked[1].weight, asked[1].intervals, asked[1].aims) == (1e-4, 200, 0)
    assert (best.weight, best.intervals) == (5e-7, 400)
    assert abs(change) <= SAME


@pytest.mark.parametrize(("left", "multipliers"), [(1e-2, False), (1e-5, True)])
def test_a_finer_mesh_takes_neither_aim_nor_multipliers_from_what_is_far_from_rest(
    monkeypatch, left, multipliers
):
    asked = {}

    def solve_again(motion, **how):
        asked.update(how)
        return motion

    monkeypatch.setattr(room, "solve_again", solve_again)
    monkeypatch.setattr(room._Rounds, "tried", lambda self, motion, aim: aim)
    motion = SimpleNamespace(intervals=100, weight=1e-4, objective=1.0)
    replays = (SimpleNamespace(residual_energy=left, miss=0.0),)
    from_ = room._TriedMotion(motion, replays, np.full(2, 3.0))
    rounds = room._Rounds(RESIDUAL, "torque", None)
    aim = rounds.again(from_, 1e-4, True)
    assert asked["multipliers"] is multipliers
    np.testing.assert_array_equal(aim, asked["aim"])
    np.testing.assert_array_equal(aim, np.full(2, 3.0 if multipliers else 0.0))


def test_where_half_the_smoothness_leads_astray_the_halving_before_counts():
    def astray(weight, intervals, aims):
        return 1e-2 if weight < 8e-7 else 1e-8

    first, again, asked = solver(astray, surcharge)
    (best, *others), _, change = refined(first, again, RESIDUAL, 100.0)
    assert (best.weight, best.intervals) == (1e-6, 200)
    assert change == pytest.approx(1.0 - surcharge(1e-6, 0) / surcharge(2e-6, 0))
    assert [(other.weight, other.intervals) for other in others] == [(1e-6, 100)]
    assert asked[-1].weight == 2e-6

    # a halving that still gains more than a per cent is not enough
    first, again, _ = solver(astray, lambda w, n: 1.0 + 30.0 * w**0.5 if n == 200 else 1.03)
    (best, *others), _, change = refined(first, again, RESIDUAL, 100.0)
    assert change > SAME
    assert others == []


def test_a_motion_that_misses_its_angle_is_aimed_as_one_that_swings():
    missing = Round(100, 1e-4, 1.0, 1e-9, 2e-3)
    assert missing.off(RESIDUAL) == pytest.approx(2.0 / 0.9)
    assert Round(100, 1e-4, 1.0, 5e-7, 1e-5).off(RESIDUAL) == pytest.approx(0.5)


def test_beside_the_best_motion_stands_one_that_is_as_good():
    first, again, _ = solver(lambda w, n, aims: 1e-8, surcharge)
    answers, _, change = refined(first, again, RESIDUAL, 100.0)
    assert [trial.weight for trial in answers] == [5e-7, 1e-6]
    assert abs(change) <= SAME

    # nothing stands beside what gains more
    first, again, _ = solver(lambda w, n, aims: 1e-8, lambda w, n: 100.0 / n)
    answers, _, change = refined(first, again, RESIDUAL, 100.0)
    assert len(answers) == 1
    assert abs(change) > SAME


def left(energy, finer):
    replays, others = ((SimpleNamespace(residual_energy=x),) for x in (energy, finer))
    return Refined(None, replays, (), RESIDUAL, 0.0, others)


def test_of_motions_as_good_the_one_that_a_finer_model_confirms_is_taken():
    # 3.0e-7 J and 5.1e-7 J differ by more than a tenth of the 1e-6 J allowed
    fast, smooth, worse = left(3.0e-7, 5.1e-7), left(4.1e-7, 4.2e-7), left(2e-6, 2e-6)
    said = []
    assert confirmed(iter([fast, smooth]), said.append) is smooth
    assert "3.00e-07 J, on a finer full model 5.10e-07 J" in said[0]
    assert confirmed(iter([smooth, fast])) is smooth
    assert confirmed(iter([fast, worse])) is fast


def test_where_a_finer_model_disagrees_the_torque_is_made_smoother_while_that_costs_little():
    def dearer(weight, intervals):
        return 1.0 + 500.0 * weight

    def stirred(weight, intervals, aims):
        return 3e-13 / weight

    best = Trial(1e-6, 200, 0, stirred(1e-6, 200, 0), dearer(1e-6, 200))
    _, again, asked = solver(stirred, dearer)
    found = list(calmer((best,), (best.entry,), RESIDUAL, again))

    # by as much as three replays differ too much, then by two; one counts that costs a per cent
    assert [trial.weight for trial in asked[1:]] == pytest.approx([3e-6, 6e-6, 12e-6, 24e-6])
    assert [trial.weight for trial, _, _ in found] == pytest.approx([3e-6, 6e-6, 12e-6])
    for trial, rounds, lost in found:
        assert trial.left <= AGREE * RESIDUAL
        assert lost == pytest.approx(1.0 - best.objective / trial.objective)
        assert 0.0 < lost <= SAME
        assert rounds[0] == best.entry
        assert rounds[-1] == trial.entry

    # what is still may agree, too: that is for its replays to say
    _, again, _ = solver(lambda weight, intervals, aims: 4e-7, lambda weight, intervals: 1.0)
    assert len(list(calmer((best,), (best.entry,), RESIDUAL, again))) == CALMER_ROUNDS

    # nothing is taken that is dearer
    _, again, asked = solver(stirred, lambda weight, intervals: 1.0 + 1e4 * weight)
    assert not list(calmer((best,), (), RESIDUAL, again))


@pytest.mark.parametrize(("change", "settled"), [(np.nan, False), (-0.05, False), (-0.005, True)])
def test_a_smoother_torque_stands_in_only_for_an_answer_that_is_settled(
    monkeypatch, change, settled
):
    answer, smoother = Trial(1e-6, 200, 0, 4e-7, 1.0), Trial(4e-6, 200, 0, 5e-8, 1.004)

    def stated(self, motion, rounds, change, elements):
        finer = 9e-7 if motion is answer else 6e-8
        replays = [(SimpleNamespace(residual_energy=x),) for x in (motion.left, finer)]
        return Refined(motion, replays[0], rounds, RESIDUAL, change, replays[1])

    motions = [SimpleNamespace(motion=m, entry=m.entry) for m in (answer, smoother)]
    monkeypatch.setattr(room, "refined", lambda *given: ((motions[0],), (), change))
    monkeypatch.setattr(room, "calmer", lambda *given: iter([(motions[1], (), 0.004)]))
    monkeypatch.setattr(room._Rounds, "stated", stated)
    monkeypatch.setattr(room, "_TriedMotion", lambda *given: motions[0])
    monkeypatch.setattr(room, "_sentence", lambda *given: "")
    motion = SimpleNamespace(
        stated=SimpleNamespace(size=2), torques=(0, 1), replays=lambda *given, **how: (None,)
    )
    monkeypatch.setattr(room, "beside_rest", lambda *given: np.zeros(2))

    found = room.refine(motion, elements=12)
    assert found.settled is settled
    assert found.motion is (smoother if settled else answer)
    assert found.confirmed is settled
    assert found.lost == (0.004 if settled else 0.0)
