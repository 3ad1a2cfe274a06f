"""A small torque added to any law brings the full model to rest."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import PPoly

from models.ancf.joints import Torque
from models.laws.unit_turns import quintic
from studies.arm.laws.rigid import feed_forward
from studies.arm.optimal.correction import added_to, correction, with_added
from studies.arm.replay.full_model import QUICK, Motion, replay
from studies.arm.stage import ELBOW, ROOT, big_arm, small_arm
from studies.cli import main
from studies.common.result import Result


@pytest.mark.parametrize("inertia", [None, 2000.0])
@pytest.mark.parametrize(("stage", "joint"), [(big_arm(8.6), ROOT), (small_arm(11.2), ELBOW)])
def test_what_a_law_leaves_is_taken_away_by_little_torque(stage, joint, inertia):
    stage = dataclasses.replace(stage, satellite_inertia=inertia)
    law = feed_forward(stage, quintic(stage.duration))
    none = PPoly(np.zeros((1, 1)), np.array([0.0, stage.duration]))
    more, left = {joint: none}, []
    for _ in range(3):
        drive = Torque(lambda t, added=more[joint]: law(t)[joint] + added(t))
        done = replay(Motion("law", "torque", stage, {joint: drive}), settings=QUICK)
        left.append(done.residual_energy)
        more = added_to(more, correction(stage, done.run.before))

    # each takes a factor of ten of the amplitude away: the modes are known to some per cent
    assert left[1] < 0.1 * left[0]
    assert left[2] < 0.01 * left[0]
    t = np.linspace(0.0, stage.duration, 2001)
    assert np.abs(more[joint](t)).max() < 0.05 * np.abs(law(t)[joint]).max()


def test_the_torque_added_starts_and_ends_with_none():
    stage = big_arm(8.6)
    law = feed_forward(stage, quintic(8.6))
    drive = Torque(lambda t: law(t)[ROOT])
    done = replay(Motion("law", "torque", stage, {ROOT: drive}), settings=QUICK)
    more = correction(stage, done.run.before)[ROOT]
    largest = np.abs(more(np.linspace(0.0, 8.6, 2001))).max()
    assert largest > 0.0
    for end in (0.0, 8.6):
        assert abs(more(end)) < 1e-9 * largest
        assert abs(more(end, 1)) < 1e-6 * largest


def test_two_piecewise_polynomials_are_added_exactly():
    first = PPoly(np.array([[1.0, -2.0], [0.5, 3.0]]), np.array([0.0, 1.0, 3.0]))
    second = PPoly(
        np.array([[2.0, 1.0, 0.5], [0.0, 1.0, 2.0], [1.0, 1.0, 1.0]]), [0, 0.5, 2.0, 3.0]
    )
    both = with_added(first, second)
    t = np.linspace(0.0, 2.999, 50)
    assert both(t) == pytest.approx(first(t) + second(t), rel=1e-13)
    assert both(t, 1) == pytest.approx(first(t, 1) + second(t, 1), rel=1e-13)


@pytest.mark.slow
def test_modes_that_eight_elements_do_not_resolve_are_left_alone(tmp_path: Path):
    # half-way round, the sixth mode of this arm is at 289 Hz; what is corrected is below 20 Hz
    arm = ["--big-length", "3.652", "--small-length", "1.436", "--tip-mass", "23.24"]
    command = ["arm", "solve", "--stage", "small", "--objective", "energy", "--duration", "16.72"]
    folder = tmp_path / "study"
    assert main([*command, *arm, "--no-figures", "--results", str(folder)]) == 0
    assert Result.load(folder).value("residual_energy") <= 1e-6
