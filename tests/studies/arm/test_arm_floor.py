"""The numerical floor of a residual energy: steps that Newton's iteration does not take."""

from types import SimpleNamespace

import pytest

from models.errors import ModelError
from studies.arm.replay import numerical_floor as room
from studies.arm.stage import big_arm


def replays_up_to(longest):
    """`replay` of motions whose fixed step [s] must be no longer; it leaves the step in joules."""

    def replay(motion, *, settings, elements=8):
        if settings.fixed_step > longest:
            raise ModelError("the Newton iteration does not converge")
        return SimpleNamespace(residual_energy=settings.fixed_step)

    return replay


def test_a_step_that_is_too_long_is_halved(monkeypatch):
    monkeypatch.setattr(room, "replay", replays_up_to(0.02))
    floor = room.numerical_floor(SimpleNamespace(stage=big_arm(60.0)))
    assert floor.step == pytest.approx(0.015)  # a thousandth of 60 s, halved twice
    assert floor.energy == pytest.approx(0.0075)


def test_no_step_short_enough_is_an_error(monkeypatch):
    monkeypatch.setattr(room, "replay", replays_up_to(1e-6))
    with pytest.raises(ModelError, match="does not converge"):
        room.numerical_floor(SimpleNamespace(stage=big_arm(60.0)))
