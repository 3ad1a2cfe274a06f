"""Verification cases of the paper's section III C against the reference runs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from models.ancf.chain import Chain
from models.ancf.integrate import Simulation, StepControl, simulate
from models.ancf.joints import Free
from models.ancf.state import posed
from models.arm.parameters import double_pendulum, single_pendulum

DATA = Path(__file__).parent / "data"
# local tolerance at which the error of the time steps is under 1e-5 m: measured 4e-8 m, 1e-6 m
STEPS = StepControl(tolerance=1e-7)


def reference(name: str) -> np.ndarray:
    return np.loadtxt(DATA / f"{name}.csv", delimiter=",", skiprows=1).T


def swing(chain: Chain, times: np.ndarray, settings: StepControl = STEPS, **options) -> Simulation:
    joints = [Free()] * len(chain.links)
    return simulate(chain, joints, posed(chain), times, settings=settings, **options)


def distance(path: np.ndarray, wanted: np.ndarray) -> float:
    return float(np.hypot(*(path - wanted)).max())


def test_single_pendulum_follows_the_reference():
    t, *tip = reference("single_pendulum")
    run = swing(single_pendulum(), t)
    assert distance(run.position(0), np.array(tip)) < 3e-4  # measured 1.7e-4, the mesh
    assert run.drift < 1e-6 * run.kinetic.max()  # measured 1.4e-9


def test_double_pendulum_follows_the_reference():
    t, x, y, xj, yj = reference("double_pendulum")
    run = swing(double_pendulum(), t)
    assert distance(run.position(1), np.array([x, y])) < 1e-4  # measured 6.2e-5, the mesh
    assert distance(run.position(0), np.array([xj, yj])) < 1e-4
    assert run.drift < 1e-6 * run.kinetic.max()  # measured 1.2e-7


@pytest.mark.parametrize(
    ("elements", "error"), [(1, 5.1e-2), (2, 3.0e-2), (4, 2.9e-3), (8, 1.9e-4)]
)
def test_single_pendulum_converges_with_the_mesh(elements, error):
    t, *tip = reference("single_pendulum")
    run = swing(single_pendulum(elements), t, StepControl(3e-7))
    # published to two digits, and against another finest mesh
    assert distance(run.position(0), np.array(tip)) == pytest.approx(error, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize(("elements", "error"), [(2, 1.5e-2), (4, 8.2e-4), (8, 5.9e-5), (16, 7e-6)])
def test_double_pendulum_converges_with_the_mesh(elements, error):
    t, x, y, *_ = reference("double_pendulum")
    run = swing(double_pendulum(elements), t, StepControl(3e-8))
    # the finest mesh meets the error of the reference itself, 7e-6 m
    assert distance(run.position(1), np.array([x, y])) < 1.2 * error + 2e-6


def test_rigid_limit_is_reached_as_one_over_stiffness():
    times = np.linspace(0.0, 0.4, 81)
    rod = solve_ivp(
        lambda t, y: [y[1], -1.5 * 9.81 / 1.2 * np.cos(y[0])],
        (0, 0.4),
        [0, 0],
        t_eval=times,
        rtol=1e-12,
        atol=1e-12,
    ).y[0]
    link, misses = single_pendulum().links[0], []
    for factor in (30.0, 300.0):
        stiff = replace(
            link,
            axial_stiffness=factor * link.axial_stiffness,
            bending_stiffness=factor * link.bending_stiffness,
        )
        chain = replace(single_pendulum(2), links=(stiff,))
        tip = swing(chain, times, StepControl(1e-8)).position(0)
        misses.append(distance(tip, 1.2 * np.array([np.cos(rod), np.sin(rod)])))
    assert misses[0] / misses[1] == pytest.approx(10.0, rel=0.15)


@pytest.mark.slow
def test_forms_agree_on_the_single_pendulum():
    times = np.linspace(0.0, 1.3, 27)
    runs = [
        swing(single_pendulum(), times, StepControl(1e-10), form=form)
        for form in ("minimal", "index-1")
    ]
    assert distance(runs[1].position(0), runs[0].position(0)) < 1e-9  # measured 3e-14
    assert runs[1].violation.max() < 1e-9


@pytest.mark.slow
def test_forms_agree_on_the_double_pendulum():
    times = np.linspace(0.0, 2.0, 41)
    runs = [
        swing(double_pendulum(), times, StepControl(1e-10), form=form)
        for form in ("minimal", "index-1")
    ]
    assert distance(runs[1].position(1), runs[0].position(1)) < 1e-9  # measured 2e-13
    assert runs[1].violation.max() < 1e-9
