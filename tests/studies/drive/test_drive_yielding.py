"""What rounding does to the mechanism through a rope that yields."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from models.laws import JerkLimited
from models.truss import DYNAMIC_SET
from studies.drive import Drive
from studies.drive.course import rope_course
from studies.drive.playback import on_the_truss, played
from studies.drive.setpoints import sampled, uniform_times
from studies.drive.yielding import DAMPING, felt
from studies.export.round_trip import round_trip

TRUSS = dataclasses.replace(  # large and on soft springs: it has hardly any tension when stowed
    DYNAMIC_SET,
    modules=18,
    bar_length=2.4,
    half_cross_bar=0.7,
    link=0.2,
    spring_stiffness=300.0,
    pulley_friction=0.02,
)
LAW = JerkLimited(60.0, TRUSS.stowed_angle, math.pi / 2, jerk=200.0 / 60.0**3).profile
COURSE = rope_course(LAW, TRUSS)
DRIVE = Drive(
    drum_radius=0.02,
    counts=65536,
    interpolation="hermite",
    bandwidth=5.0,
    rope_yields="along its length",
)


def mass_and_share(wound: float) -> tuple[float, float]:
    """dF / d(rope acceleration) [kg], and mean tension over pull, by differences of two replays."""
    rows = np.zeros((4, 2))
    rows[0], rows[2] = wound, (0.0, 1.0)
    found = on_the_truss(rows, TRUSS)
    return float(found.force[1] - found.force[0]), float(found.mean_tension[0] / found.force[0])


@pytest.mark.slow
def test_the_mechanism_moves_as_a_mass_on_the_rope() -> None:
    drive = dataclasses.replace(DRIVE, rope_stiffness=2e4)
    times = uniform_times(COURSE, 0.01)
    smooth = sampled(COURSE, times)
    rounded = sampled(COURSE, times, drive.count("m"))
    output, exact = (played(COURSE, points, drive) for points in (rounded, smooth))
    found = felt(output, exact, times, TRUSS, drive)

    # another integrator, from rest: the first 10 s, where a rigid rope has a mass of tonnes
    wound = np.linspace(0.0, 0.5, 200)
    masses, shares = np.array([mass_and_share(one) for one in wound]).T

    def rates(time: float, state: np.ndarray) -> np.ndarray:
        at = np.array([time])
        rope = exact.at(at)[0, 0]
        square = 2e4 / np.interp(rope, wound, masses * shares)
        off = output.at(at)[0, 0] - rope
        pull = square * (off - state[0]) - 2 * DAMPING * math.sqrt(square) * state[1]
        return np.array([state[1], pull])

    at = np.linspace(0.0, 10.0, 401)
    solved = solve_ivp(rates, (0.0, 10.0), [0.0, 0.0], "DOP853", at, rtol=1e-7, atol=1e-13)
    mine = np.stack([np.interp(at[1:-1], output.time, row) for row in found[:2]])
    # of the largest: masses are interpolated here, and constant for some milliseconds there
    for row, other in zip(mine, solved.y[:, 1:-1], strict=True):
        assert np.abs(row - other).max() < 0.02 * np.abs(other).max()


def test_micrometres_of_rounding_leave_no_rope_slack() -> None:
    # a rope that cannot stretch would push with newtons: 1.9 micrometres in steps of 10 ms
    times = uniform_times(COURSE, 0.01)
    points = sampled(COURSE, times, DRIVE.count("m"))
    rigid = on_the_truss(played(COURSE, points, DRIVE).motion, TRUSS)
    assert float(rigid.far_end.min()) < 0.0

    record = round_trip(COURSE, points, DRIVE, truss=TRUSS)
    smooth = round_trip(COURSE, sampled(COURSE, times), DRIVE, truss=TRUSS)
    least = "least tension of all segments [N]"
    assert record.breaches == ()
    # of a steel rope of 3 mm, 1.8e4 N/m: a count of it is 0.03 N
    assert record.values[least] == pytest.approx(smooth.values[least], abs=0.05)


def test_a_stiffer_rope_hands_on_more_of_the_rounding() -> None:
    points = sampled(COURSE, uniform_times(COURSE, 0.01), DRIVE.count("m"))
    peaks = []
    for stiffness in (2e3, 2e5, 2e9):
        drive = dataclasses.replace(DRIVE, rope_stiffness=stiffness)
        output = played(COURSE, points, drive)
        smooth = played(COURSE, sampled(COURSE, points.times), drive)
        off = felt(output, smooth, points.times, TRUSS, drive)
        early = output.time < 5.0
        peaks.append(float(np.abs(off[2, early]).max()))
    assert peaks[0] < peaks[1] < peaks[2]
    # what a rigid rope hands on
    rigid = float(np.abs((output.motion[2] - smooth.at(output.time)[2])[early]).max())
    assert peaks[2] == pytest.approx(rigid, rel=0.05)
