"""Singular and chattering problems, and free headings: what the files state, the engine finds."""

import math

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from benchmarks.shows.engine.engine_problem import problem_of
from benchmarks.shows.engine.variant import Variant, catalogue
from ocp import Accuracy, Settings, solve
from tests.benchmarks.shows.arcs import optimum_of

SINGULAR = catalogue("singular")
OF_ARCS = [name for name, stated in SINGULAR.items() if "arcs" in stated]
TAKES_LONG = {"predators_and_prey"}
STATED = [(file, name) for file in ("singular", "headings") for name in catalogue(file)]

# Fuller's curve of switches x = -C v |v|, and how much shorter each arc is than the one before:
# A. T. Fuller, Int. J. Control 1 (1963); Zelikin and Borisov 1994, ch. 2
C = math.sqrt((math.sqrt(33) - 1) / 24)
SHORTER = math.sqrt((0.5 - C) / (0.5 + C))


def stated_optimum(name: str) -> float:
    return Variant.nominal(name, "singular").value(SINGULAR[name]["optimum"])


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow if n in TAKES_LONG else ()) for n in OF_ARCS]
)
def test_the_arcs_give_the_optimum(name: str) -> None:
    known = optimum_of(Variant.nominal(name, "singular"))
    assert known.error < 1e-10
    assert min(known.lengths) > 0
    assert known.objective == pytest.approx(stated_optimum(name), rel=1e-11)


def test_the_arcs_of_the_regulator_are_its_closed_form() -> None:
    known = optimum_of(Variant.nominal("regulator", "singular"))
    bang, singular = known.lengths
    x, v = bang - bang**2 / 2, 1 - bang

    # u = x: x and v are sums of exp(t) and exp(-t)
    bang_cost = quadratic_cost(0, 1, -1, bang) + float((Polynomial([1, -1]) ** 2).integ()(bang))
    rising = (x**2 + v**2) * math.sinh(2 * singular) / 2
    singular_cost = rising + x * v * (math.cosh(2 * singular) - 1)
    assert known.objective == pytest.approx(bang_cost + singular_cost, rel=1e-10)


def quadratic_cost(x: float, v: float, u: float, time: float) -> float:
    """The integral of x^2 along an arc with x'' = u."""
    return float((Polynomial([x, v, u / 2]) ** 2).integ()(time))


def from_the_curve(speed: float) -> float:
    """The cost from a point of Fuller's curve to rest: a geometric series of arcs."""
    arc = quadratic_cost(C * speed**2, -speed, 1, (1 + SHORTER) * speed)
    return arc / (1 - SHORTER**5)


def test_fullers_optima_are_their_series() -> None:
    first = math.sqrt(1 / (C + 0.5))  # from x = 1 at rest to the curve
    from_rest = quadratic_cost(1, 0, -1, first) + from_the_curve(first)
    assert stated_optimum("fuller") == pytest.approx(from_rest, rel=2e-12)

    # 1e5 times the cost of 0.01 to 0 and back, and costs grow as x^(5/2)
    there_and_back = 1e5 * 2 * from_rest * 0.01**2.5
    assert stated_optimum("fuller_from_rest_to_rest") == pytest.approx(there_and_back, rel=2e-12)

    # from x = 0 with speed 1: braked to rest, then back to the curve
    speed = math.sqrt(0.5 / (C + 0.5))
    of_position = quadratic_cost(0, 1, -1, 1 + speed) + from_the_curve(speed)
    assert stated_optimum("regulator_of_position") == pytest.approx(of_position, rel=2e-12)


def test_a_series_of_arcs_comes_to_rest_in_time() -> None:
    # what the closed forms take for granted: rest before the end, 5 and half of 1 (by scale)
    first = math.sqrt(1 / (C + 0.5))
    whole = first + first * (1 + SHORTER) / (1 - SHORTER)
    assert whole < 5
    assert np.sqrt(0.01) * whole < 0.5


# a state that nothing depends on is stated as the source has it
@pytest.mark.filterwarnings("ignore::ocp.errors.StatementWarning")
@pytest.mark.parametrize("asked", [None, pytest.param(1e-8, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("file", "name"), STATED)
def test_the_engine_finds_them_as_accurately_as_asked(
    file: str, name: str, asked: float | None
) -> None:
    variant = Variant.nominal(name, file)
    settings = Settings() if asked is None else Settings(accuracy=Accuracy(objective=asked))
    found = solve(problem_of(variant, True), settings=settings)
    # 1e-6 by default; one source gives its optimum to six digits
    allowed = max(asked or 1e-6, variant.stated.get("optimum_known_to", 0.0))
    assert found.objective == pytest.approx(variant.value(variant.stated["optimum"]), rel=allowed)
