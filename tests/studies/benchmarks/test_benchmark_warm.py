"""Warm starts of the benchmarks."""

import pytest

from ocp import Constant
from studies.benchmarks.problems import CATALOGUE
from studies.benchmarks.warm import WarmStart, passed, warm_start


def _counted(cold: int | None, warm: int | None, difference: float = 0.0) -> WarmStart:
    return WarmStart("some", "number", 1.0, 1.05, 20, cold, warm, difference)


def test_every_benchmark_names_a_number_of_its_own() -> None:
    for make in CATALOGUE.values():
        made = make()
        assert isinstance(made.varied, Constant)
        assert made.varied in made.problem.constants


def test_two_thirds_have_to_be_halved_and_none_may_be_worse() -> None:
    half, same, short = _counted(20, 10), _counted(20, 22), _counted(9, 9)
    assert passed([half, half, same, short])
    assert not passed([half, same, short])
    assert not passed([half, half, _counted(20, 23)])
    assert not passed([half, half, _counted(20, 10, 1e-5)])
    assert passed([half, half, _counted(20, 10, -1e-5)])  # a better optimum is no fault
    assert not passed([half, half, half, _counted(20, None)])
    assert passed([half, _counted(None, 40)])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["brachistochrone", "cartpole_kelly", "gas_oil", "robot_arm"])
def test_quick_ones_are_halved(name: str) -> None:
    found = warm_start(CATALOGUE[name]())
    assert found.counts
    assert found.halved
    assert found.kept
