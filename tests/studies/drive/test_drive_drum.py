"""The drum: layers and climbs, against a drum that is wound up step by step."""

import math

import casadi as ca
import numpy as np
import pytest

from studies.drive.drum import TURN, Drum

PLAIN, LAYERED, SPIRAL = Drum(0.02), Drum(0.02, 0.003, 10), Drum(0.02, 0.003, 1)


def wound(drum: Drum, turn: float, steps: int = 200_000) -> float:
    """Rope on a drum by its description: mean radius of each small turn, added up."""
    middle = (np.arange(steps) + 0.5) * turn / steps
    layer, within = np.divmod(middle / TURN, drum.turns)
    climbed = np.clip(within - (drum.turns - 1), 0.0, 1.0)
    return float((drum.radius + drum.growth * (layer + climbed)).sum() * turn / steps)


@pytest.mark.parametrize("drum", [PLAIN, LAYERED, SPIRAL, Drum(0.015, 0.001, 7.5)])
def test_the_rope_on_a_drum_is_what_its_turns_add_up_to(drum: Drum) -> None:
    turns = TURN * np.array([0.3, 6.7, 9.4, 10.0, 23.8, 39.9])
    # the sum misses at the ends of climbs, by a step of the turn times a growth
    expected = [wound(drum, turn) for turn in turns]
    assert drum.rope_at(turns) == pytest.approx(expected, abs=1e-8)
    assert drum.turn_at(drum.rope_at(turns)) == pytest.approx(turns, rel=1e-13)


def test_ten_turns_are_a_layer_whose_last_one_climbs() -> None:
    held = TURN * (9 * 0.02 + 0.0215)
    assert LAYERED.corners(1.3) == pytest.approx([TURN * 9 * 0.02, held], rel=1e-14)
    at = [LAYERED.radius_at(rope) for rope in (0.0, 0.5, TURN * 9 * 0.02, held, held + 0.5)]
    assert at == pytest.approx([0.02, 0.02, 0.02, 0.023, 0.023], rel=1e-12)
    # one turn a layer is a spiral: r^2 = r0^2 + d s / pi
    assert SPIRAL.radius_at(6.0) == pytest.approx(math.sqrt(0.02**2 + 0.018 / math.pi), rel=1e-12)


def test_an_expression_has_the_values_of_an_array() -> None:
    rope = np.linspace(-0.01, 6.6, 1001)
    symbol = ca.SX.sym("s")
    kernel = ca.Function("drum", [symbol], [LAYERED.radius_at(symbol), LAYERED.turn_at(symbol)])
    radius, turn = (row.full().ravel() for row in kernel(rope[None]))
    assert radius == pytest.approx(LAYERED.radius_at(rope), rel=1e-15)
    assert turn == pytest.approx(LAYERED.turn_at(rope), rel=1e-15)


@pytest.mark.parametrize("drum", [PLAIN, LAYERED, SPIRAL])
def test_rope_and_drum_move_by_the_chain_rule(drum: Drum) -> None:
    time = np.linspace(0.0, 1.0, 300)
    rope = np.stack([3 * time**4, 12 * time**3, 36 * time**2, 72 * time])
    turned = drum.turned(rope)
    assert drum.wound(turned) == pytest.approx(rope, rel=1e-10, abs=1e-12)
    # speed and acceleration are slopes of what is above them, to the difference's error
    h = 1e-6
    again = [drum.turn_at(3 * (time[1:] + k * h) ** 4) for k in (-1, 0, 1)]
    slope = (again[2] - again[0]) / (2 * h)
    assert slope == pytest.approx(turned[1][1:], rel=1e-6, abs=1e-6)
