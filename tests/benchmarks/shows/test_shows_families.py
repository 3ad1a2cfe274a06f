"""Families: a plain collocation finds the benchmarks' optima; what is said of an answer."""

import math

import numpy as np
import pytest

from benchmarks.optima.catalogue import CATALOGUE
from benchmarks.shows.engine import comparison
from benchmarks.shows.engine.comparison import GUESSES, Reference, by_engine, compared, kind_of
from benchmarks.shows.engine.families import question
from benchmarks.shows.engine.plain import DEGREE, Plain, Start, crude_start, radau
from benchmarks.shows.engine.variant import Variant, catalogue
from ocp import Settings

# what 200 plain intervals of degree 3 are off by: hardly anything where all is smooth, a part of a
# switch's interval where not, and more where stiffness needs a finer mesh
PLAIN = {"hypersensitive_50": 1e-4}


def test_the_points_are_those_of_radau() -> None:
    points, slopes, weights = radau()
    # (4 -+ sqrt 6)/10 and 1: Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5
    assert points == pytest.approx([(4 - math.sqrt(6)) / 10, (4 + math.sqrt(6)) / 10, 1])
    nodes = np.concatenate([[0], points])
    for power in range(2 * DEGREE - 1):
        assert weights @ points**power == pytest.approx(1 / (power + 1))
    for power in range(1, DEGREE + 1):
        assert nodes**power @ slopes == pytest.approx(power * points ** (power - 1))


def test_nominal_numbers_lie_within_their_ranges() -> None:
    for name in catalogue():
        varied = Variant.nominal(name).stated["vary"]
        nominal = Variant.nominal(name).numbers
        for key, (_, low, high) in varied.items():
            assert (
                Variant.nominal(name).value(low)
                <= nominal[key]
                <= Variant.nominal(name).value(high)
            )


def test_a_question_can_be_asked_again() -> None:
    assert question(3, 17) == question(3, 17)
    assert question(3, 17)["problem"] == list(catalogue())[2]
    assert question(3, 17)["numbers"] != question(3, 32)["numbers"]


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted({*catalogue()} - {"alp_rider"}))  # a minute: drawn below
def test_the_plain_collocation_finds_the_trusted_optimum(name: str) -> None:
    variant, benchmark = Variant.nominal(name), CATALOGUE[name]()
    value = Plain(variant, 200).solve(crude_start(variant))
    assert value == pytest.approx(benchmark.optimum, rel=PLAIN.get(name, 1e-5))


@pytest.mark.slow
@pytest.mark.parametrize("index", range(15))
def test_no_draw_of_any_family_is_wrong_and_called_right(index: int) -> None:
    drawn = Variant.drawn(question(100, index)["problem"], np.random.default_rng([100, index]))
    guesses = (GUESSES[index % 2],)  # the show tries both
    row = compared(drawn, Reference(random_starts=0, audits=False, guesses=guesses))
    # another optimum than the best is no mistake of a solve from one start
    allowed = ("right", "other optimum", "none exists")
    assert all(own["kind"] in allowed for own in row["answers"].values())


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "index", "guess"), [(302, 59, "none"), (401, 44, "crude")])
def test_a_limit_that_another_one_implies_is_no_false_alarm(
    seed: int, index: int, guess: str
) -> None:
    # the dry mass and a thrust that is not negative: multipliers are millions, differences 1e-12
    random = np.random.default_rng([seed, index])
    found, solution = by_engine(Variant.drawn("goddard_betts_3ph", random), guess, Settings())
    assert found["open"] == ""

    assert solution is not None
    iterate = solution.kept_iterate
    lower, upper = iterate.limits.columns
    assert (lower <= iterate.x).all()
    assert (iterate.x <= upper).all()


def test_an_answer_is_judged_by_what_the_plain_collocation_finds() -> None:
    jerk = Variant.nominal("peak_accel_jerk")
    assert not jerk.proven_without_motion
    far = Variant(jerk.name, jerk.stated, {**jerk.numbers, "distance": 1.6})
    assert far.proven_without_motion  # 6 * 2^3/32 = 1.5 m is the farthest

    def kind(variant: Variant, value: float | None, *plain: float) -> str:
        return kind_of(variant, {"value": value}, plain, min(plain, default=math.nan), 1e-3)

    assert kind(jerk, 1.0, 1.0005, 2.0) == "right"
    assert kind(jerk, 2.0, 1.0, 2.0) == "other optimum"
    assert kind(jerk, 1.5, 1.0, 2.0) == "wrong"
    assert kind(jerk, 0.9, 1.0, 2.0) == "wrong"
    assert kind(jerk, None, 1.0) == "honest failure"
    assert kind(jerk, None) == "none found"
    assert kind(jerk, 1.0) == "not compared"
    assert kind(far, None) == "none exists"
    assert kind(far, 1.0, 1.0) == "wrong"
    assert kind(far, 1.0) == "wrong"


def test_a_mesh_whose_half_finds_nothing_judges_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    # meshes err by 1/N^2, and one of 400 intervals finds nothing
    class Erring:
        def __init__(self, variant: Variant, intervals: int) -> None:
            self.intervals = intervals

        def solve(self, start: object, *, close: bool = False) -> float:
            found = close and self.intervals > 400
            error = (100 / self.intervals) ** 2
            return 10 + error if found else math.nan

    monkeypatch.setattr(comparison, "Plain", Erring)
    variant = Variant.nominal("brachistochrone")
    kinds = []
    for value in (10.0, 9.9):
        answers = {"crude": {"value": value}}
        found = comparison.judged_finer(
            variant, answers, 200, {"crude": crude_start(variant)}, {"engine": Start({}, {})}
        )
        kinds.append(answers["crude"]["kind"])
        assert found["change"] == pytest.approx(1 / 64 - 1 / 256)
    assert kinds == ["right", "wrong"]
