"""Laws of many durations abreast, and the search for the least one that leaves the arm still."""

import dataclasses

import numpy as np
import pytest

from models.arm.reduced_simulation import simulate_reduced
from models.laws.unit_turns import linear_torque, quintic
from studies.arm.laws.rigid import torque_drives
from studies.arm.laws.scan import left_by_laws
from studies.arm.laws.shapers import free_frequencies, locked_frequency, needs_search, shaper_note
from studies.arm.optimal.objectives import RESIDUAL
from studies.arm.questions.least_duration import first_pass, windows
from studies.arm.replay.numerical_floor import Floor
from studies.arm.replay.reduced_model import reduced_residual
from studies.arm.stage import big_arm, small_arm


def left_alone(stage, law, **how):
    """E_res [J] of one law under torque, by another integrator."""
    motion = simulate_reduced(
        stage.model,
        stage.model.at(*stage.start),
        np.array([0.0, stage.duration]),
        root=torque_drives(stage, law)[0],
        **how,
    )
    return reduced_residual(stage, motion)


def test_laws_abreast_leave_what_each_leaves_alone():
    stage = big_arm(4.0)
    laws = [quintic(4.0), quintic(3.0), linear_torque(4.0)]
    found = left_by_laws(stage, laws, "torque")
    jump = 0.1  # it stirs modes so fast for the steps that these damp them
    for law, left, share in zip(laws, found, (1e-3, 1e-3, jump), strict=True):
        alone = left_alone(stage.lasting(law.duration), law, tolerance=1e-7)
        assert left == pytest.approx(alone, rel=share)


@pytest.mark.parametrize("ratio", [0.01, pytest.param(0.1, marks=pytest.mark.slow)])
def test_damped_arms_are_scanned_by_steps_that_their_fastest_mode_stands(ratio):
    # its fastest mode is damped 1.4 and 14 times beyond critical
    stage = big_arm(4.0)
    stage = dataclasses.replace(stage, arm=dataclasses.replace(stage.arm, damping_ratio=ratio))
    law = quintic(stage.duration)
    (found,) = left_by_laws(stage, [law], "torque")
    alone = left_alone(stage, law, tolerance=1e-8, method="Radau")
    assert found == pytest.approx(alone, rel=1e-3)


def test_frequencies_that_shapers_are_tuned_to():
    big, small = big_arm(8.6), small_arm(11.2)
    assert free_frequencies(big.lasting(1.0)) == pytest.approx([2.178] * 25, abs=1e-3)
    assert min(free_frequencies(small.lasting(1.0))) == pytest.approx(0.985, abs=1e-3)
    assert max(free_frequencies(small.lasting(1.0))) == pytest.approx(6.73, abs=5e-3)
    assert locked_frequency(small) == pytest.approx(0.4453, abs=1e-4)
    assert [needs_search(s, "ZVD", "torque") for s in (big, small)] == [False, True]
    assert "varies between 0.985 and 6.73 Hz" in shaper_note(small, "torque")


def test_windows_hold_the_dips_that_come_near():
    durations = np.arange(8.0)
    left = RESIDUAL * np.array([90.0, 3.0, 2.0, 3.5, 90.0, 9.0, 20.0, 1.0])
    assert windows(durations, left) == [(0.0, 2.0, 3.0), (6.0, 7.0, 7.0)]
    assert windows(durations, left, ended=False) == [(0.0, 2.0, 3.0)]


@dataclasses.dataclass
class Fake:
    """A replay that leaves a parabola of the duration."""

    at: float
    residual_energy: float
    peak_torque = (1.0, 0.0)

    class motion:
        stage = big_arm(8.6)


def test_first_duration_of_a_dip_between_the_points_of_the_scan():
    def on_full(T: float) -> Fake:
        return Fake(T, 0.5 * RESIDUAL + 1e-3 * (T - 9.03) ** 2)

    found = first_pass(on_full, (8.9, 9.0, 9.1), cap=2.0)
    edge = 9.03 - np.sqrt(0.5e-3 * RESIDUAL / 1e-6)
    assert edge <= found.at < 9.03
    assert first_pass(on_full, (8.9, 9.0, 9.1), cap=0.5) is None


def test_no_longer_duration_is_replayed_than_one_that_passes():
    asked = []

    def on_full(T: float) -> Fake:
        asked.append(T)
        return Fake(T, 0.5 * RESIDUAL)

    # a dip at the beginning of a scan has nothing before it
    found = first_pass(on_full, (9.0, 9.0, 9.1), cap=2.0)
    assert found is not None
    assert found.at == 9.0
    assert asked == [9.0]


def test_the_floor_is_the_largest_change():
    assert Floor(0.1, 3e-15, 1e-15, 4e-15).energy == pytest.approx(2e-15)
