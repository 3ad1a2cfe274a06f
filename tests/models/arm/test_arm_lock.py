"""Locks of the arm's two stages: what the smooth and the paper's linear torque leave behind."""

import numpy as np
import pytest

from models.ancf.analysis import LockedRun, run_and_lock
from models.ancf.integrate import StepControl
from models.ancf.joints import Locked, Torque
from models.ancf.state import posed
from models.arm.parameters import ArmParameters

ARM = ArmParameters()


def linear(inertia: float, turn: float, T: float) -> Torque:
    """The paper's torque, from +tau0 to -tau0 with tau0 = 6 J dtheta / T^2."""
    return Torque(lambda t: 6 * inertia * turn / T**2 * (1 - 2 * t / T))


def step5(inertia: float, turn: float, T: float) -> Torque:
    """Rigid torque of the velocity law (40): Step5 up to 2 dtheta / T and down again."""

    def torque(t: np.ndarray) -> np.ndarray:
        x = np.where(t < T / 2, 2 * t / T, 2 - 2 * t / T)
        rate = 4 * turn / T**2 * 30 * x**2 * (1 - x) ** 2
        return inertia * np.where(t < T / 2, rate, -rate)

    return Torque(torque, breakpoints=(T / 2,))


def big_arm(law, T: float, settings: StepControl) -> LockedRun:
    chain = ARM.chain(8)
    joints = [law(ARM.root_inertia(np.pi), np.pi / 2, T), Locked(np.pi)]
    return run_and_lock(
        chain,
        joints,
        posed(chain, [0.0, np.pi]),
        np.array([0.0, T]),
        [0],
        targets={0: np.pi / 2},
        settings=settings,
    )


def small_arm(law, T: float, settings: StepControl) -> LockedRun:
    chain = ARM.chain(8)
    joints = [Locked(0.0), law(ARM.elbow_inertia, -np.pi, T)]
    return run_and_lock(
        chain,
        joints,
        posed(chain, [0.0, np.pi]),
        np.linspace(0.0, T, 57),
        [1],
        targets={1: 0.0},
        settings=settings,
    )


@pytest.mark.parametrize(
    ("stage", "T", "left"), [(big_arm, 8.6, 8.8e-6), (small_arm, 11.2, 2.1e-3)]
)
def test_smooth_torque_leaves_little(stage, T, left):
    run = stage(step5, T, StepControl(1e-8))
    assert run.residual_energy == pytest.approx(left, rel=0.03)  # given to two digits


def test_linear_torque_shakes_the_big_arm():
    # the jump of torque rings modes of kilohertz for ever; those too fast for the step are
    # damped by the method, which takes 5 % of the energy at this step
    run = big_arm(linear, 8.6, StepControl(1e-7, fixed_step=0.005))
    assert run.residual_energy == pytest.approx(1.1e-2, rel=0.08)
    assert run.engagement.miss[0] == pytest.approx(-2.2e-3, rel=0.1)


def test_paper_pace_of_the_small_arm_moves_the_elbow_by_tenths_of_a_millimetre():
    run = small_arm(linear, 112.0, StepControl(1e-6, fixed_step=0.05))
    path = run.before.position(0)
    assert np.hypot(path[0] - 3.0, path[1]).max() == pytest.approx(1.5e-4, rel=0.1)
    assert abs(run.engagement.miss[1]) < 1e-3
