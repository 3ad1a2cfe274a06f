"""Laws that integrate the acceleration of a replay: what rests for long does not creep."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from models.laws import Hermite
from ocp.arrays import Array
from studies.cli import main
from studies.common.result import Result
from studies.truss.motions.integrated import GAUSS_POINTS, GAUSS_WEIGHTS, HELD, held

ROWS = 16
START = 0.1


def _angle(time: Array) -> Array:
    """From START to START + 1 rad, with the time constant 1 s."""
    return START + 1.0 - np.exp(-time) * (1.0 + time)


def _speed(time: Array) -> Array:
    return time * np.exp(-time)


def _law(edges: Array, bias: float, hold: bool) -> tuple[Hermite, Array]:
    """The law of an acceleration that is off by `bias` [rad/s^2], and its rows' times."""
    width = np.diff(edges)[:, None] / ROWS
    times = edges[:-1, None] + width * np.arange(ROWS + 1)
    inner = times[:, :-1, None] + width[:, :, None] * GAUSS_POINTS

    def acceleration(time: Array) -> Array:
        return (1.0 - time) * np.exp(-time) + bias

    gains = width * (acceleration(inner) @ GAUSS_WEIGHTS)
    turns = width**2 * (acceleration(inner) @ (GAUSS_WEIGHTS * (1.0 - GAUSS_POINTS)))
    values = acceleration(times)
    if hold:
        ends = np.column_stack([_angle(edges[1:]), _speed(edges[1:])])
        pieces, flat_gains, flat_turns = held(START, times, values, gains, turns, ends)
    else:
        pieces, flat_gains, flat_turns = list(np.dstack([times, values])), *_flat(gains, turns)

    rows = np.vstack([*(piece[:-1] for piece in pieces), pieces[-1][-1:]])
    before = np.concatenate([pieces[0][:1, 1], *(piece[1:, 1] for piece in pieces)])
    speeds = np.cumsum(np.append(0.0, flat_gains))
    steps = np.diff(rows[:, 0]) * speeds[:-1] + flat_turns
    angles = np.cumsum(np.append(START, steps))
    law = Hermite(rows[:, 0], angles, speeds, rows[:, 1], before, flat_gains, flat_turns)
    return law, rows[:, 0]


def _flat(gains: Array, turns: Array) -> tuple[Array, Array]:
    return gains.ravel(), turns.ravel()


def test_a_long_rest_does_not_creep() -> None:
    # 600 s at rest turn a bias of 1e-9 rad/s^2 into 1.8e-4 rad: b T^2 / 2
    edges = np.linspace(0.0, 600.0, 1201)
    free, _ = _law(edges, 1e-9, hold=False)
    law, times = _law(edges, 1e-9, hold=True)

    assert free.motion(600.0).angle - _angle(600.0) == pytest.approx(1.8e-4, rel=1e-3)
    assert np.abs(law.motion(times).angle - _angle(times)).max() < 1e-9
    assert np.abs(law.motion(times).speed - _speed(times)).max() < 1e-9
    assert np.abs(law.motion(times).acceleration - free.motion(times).acceleration).max() < HELD


def test_rounding_in_a_short_interval_is_no_acceleration() -> None:
    # states good to 1e-13 say nothing of the acceleration within 1e-6 s
    edges = np.array([0.0, 1.0, 1.0 + 1e-6, 1.0 + 2e-6, 2.0])
    law, times = _law(edges, 0.0, hold=True)
    exact = (1.0 - times) * np.exp(-times)

    assert np.abs(law.motion(times).acceleration - exact).max() < 2 * HELD
    assert law.motion(2.0).angle == pytest.approx(_angle(np.array(2.0)), abs=1e-11)


@pytest.mark.slow
def test_a_motion_that_waits_for_minutes_ends_open(tmp_path: Path) -> None:
    # without caps it crosses the ridge of the static force, and waits behind it until T ends; the
    # integral of its acceleration ended 1.8e-4 rad past the open truss, where no model holds
    lengths = {
        "bar_length": 1.264,
        "half_cross_bar": 0.4664,
        "crank": 0.09942,
        "link": 0.1304,
        "spring_free_length": 0.2769,
    }
    command = ["truss", "--objective", "peak-force", "--friction", "0.04389", "--modules", "6"]
    for name, length in lengths.items():
        command += ["--parameter", f"{name}={length}"]
    folder = tmp_path / "study"
    code = main([*command, "--duration", "582.2", "--no-figures", "--results", str(folder)])

    assert code == 0
    result = Result.load(folder)
    angles = result.arrays["angle"].values
    # source: the greatest static force of this truss is 19.68228 N
    assert result.value("peak-force") == pytest.approx(19.68228, rel=1e-5)
    assert angles[-1] == pytest.approx(np.pi / 2, abs=1e-9)
