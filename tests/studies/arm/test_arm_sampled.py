"""Motions as drives follow them: samples, joined by a spline, leave what the motion leaves."""

from types import SimpleNamespace

import numpy as np
import pytest

from models.ancf.integrate import StepControl
from models.ancf.joints import Driven, Torque
from models.laws.unit_turns import quintic
from studies.arm.laws.rigid import angle_drives, torque_drives
from studies.arm.replay.full_model import SMOOTH, Motion, replay
from studies.arm.replay.sampled import STEPS, interpolated, sample_times, sampled, sampled_to
from studies.arm.stage import big_arm
from studies.check.arm import _through

STAGE = big_arm(8.6)


def exact(drive):
    """The quintic step, four elements a link."""
    make = torque_drives if drive == "torque" else angle_drives
    motion = Motion("quintic", drive, STAGE, dict(make(STAGE, quintic(8.6))))
    return replay(motion, elements=4, settings=StepControl(1e-8), modes=1)


@pytest.mark.parametrize("drive", ["torque", "angle"])
def test_samples_leave_what_the_motion_leaves(drive):
    done = exact(drive)
    profile = sampled_to(done, 2.0 * done.residual_energy, elements=4)
    assert profile.step == pytest.approx(STEPS[0], rel=1e-3)  # smooth: the longest will do
    # the torque of the quintic step begins with a slope, which the spline takes away
    assert profile.residual_energy == pytest.approx(done.residual_energy, rel=0.03)


@pytest.mark.parametrize(("residual", "replays"), [(1e-6, 2), (1e-8, 1)])
def test_samples_are_replayed_finely_only_where_they_were_not_yet(residual, replays, monkeypatch):
    asked = []

    def replay_(motion, elements, settings):
        asked.append(settings)
        return SimpleNamespace(residual_energy=0.5 * residual, fixed=None)

    monkeypatch.setattr("studies.arm.replay.sampled.replay", replay_)
    law = Torque(lambda t: np.sin(np.asarray(t)))
    sampled_to(SimpleNamespace(motion=Motion("wave", "torque", STAGE, {0: law})), residual)
    assert len(asked) == replays
    assert asked[-1] == SMOOTH


def test_where_no_step_keeps_the_residual_the_shortest_is_taken(monkeypatch):
    monkeypatch.setattr("studies.arm.replay.sampled.STEPS", (0.2, 0.1))
    profile = sampled_to(exact("angle"), 1e-30, elements=4)
    assert profile.step == pytest.approx(0.1, rel=1e-3)


def test_a_spline_begins_and_ends_without_slope():
    times = sample_times(8.6, 0.02)
    assert (times[0], times[-1]) == (0.0, 8.6)
    for drive, kind in (("torque", Torque), ("angle", Driven)):
        law = next(iter(exact(drive).motion.joints.values()))
        joint = interpolated(drive, times, sampled(law, times))
        assert isinstance(joint, kind)
        assert sampled(joint, times) == pytest.approx(sampled(law, times), abs=1e-12)
    ends = joint.rate(np.array([0.0, 8.6]))
    assert ends == pytest.approx([0.0, 0.0], abs=1e-12)


def test_an_export_is_checked_by_the_spline_it_states_however_steep_it_is():
    # every other row does not tell this pulse, so that rows of unknown origin are joined monotonely
    times = np.linspace(0.0, 1.0, 21)
    values = np.where(np.abs(times - 0.5) < 0.03, 1.0, 0.0)
    fine = np.linspace(0.0, 1.0, 501)
    stated = interpolated("torque", times, values)
    assert np.array_equal(_through(times, values, exported=True)(fine), stated.torque(fine))
    assert not np.allclose(_through(times, values, exported=False)(fine), stated.torque(fine))
