"""The rows of quantities: each names keys that are there, and says the same in both its forms."""

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest

from models.truss import DYNAMIC_SET
from ocp import Control, State
from studies.drive import Drive
from studies.margin.schema import MarginRequirements
from studies.truss.config import TrussStudy
from studies.truss.expressions import Instant, Signals
from studies.truss.limits.caps import CAPPED, CURVE, HARD, Caps, cap_on
from studies.truss.limits.sizes import Sizes
from studies.truss.motions.deployment import Deployment, Histories
from studies.truss.motions.laws import pinned_bezier
from studies.truss.quantities import OBJECTIVES, QUANTITIES

DRIVE = Drive(
    drum_radius=0.02,
    rope_diameter=0.001,
    layer_turns=20.0,
    gear_ratio=20.0,
    efficiency=0.8,
    motor_inertia=1e-5,
    torque_speed=((50.0, 0.6), (150.0, 0.1)),
)
STUDY = TrussStudy(
    minimise="peak-rope-jerk",
    duration=6.0,
    drive=DRIVE,
    margin=MarginRequirements(static=0.5, dynamic=0.2, available=500.0),
)
DEPLOYMENT = Deployment("Bezier", pinned_bezier(DYNAMIC_SET, 6.0), DYNAMIC_SET, DRIVE, STUDY.margin)
TIMES = np.linspace(0.2, 5.8, 23)
ALONG = Histories(DEPLOYMENT, TIMES)


# a signal's own row has no expression, and the arm has states of its own
BOTH_FORMS = [
    key
    for key, one in QUANTITIES.items()
    if one.history(ALONG) is not None and key not in ("peak-speed", "peak-jerk")
]


@pytest.mark.parametrize("key", BOTH_FORMS)
def test_a_quantity_along_a_motion_is_that_of_the_problem(key: str) -> None:
    angle, speed, acceleration = State("a", "rad"), State("v", "rad/s"), State("c", "rad/s^2")
    jerk = Control("j", "rad/s^3")
    signals = Signals(DYNAMIC_SET, angle, speed, acceleration, jerk, None)
    quantity, law = QUANTITIES[key], ALONG.law
    formulas = quantity.expression(Instant(STUDY, signals, "by angle"))

    symbols = [one.symbol for one in (angle, speed, acceleration, jerk)]
    function = ca.Function("row", symbols, [ca.vertcat(*formulas)])
    rows = (row[None] for row in (law.angle, law.speed, law.acceleration, law.jerk))
    values = function(*rows).full()
    expected = np.abs(values).max(axis=0) if quantity.both_signs else values.max(axis=0)
    if quantity.kind == "least":  # tensions fall along the rope
        expected = values.min(axis=0)
    np.testing.assert_allclose(quantity.history(ALONG), expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("key", [key for key, one in OBJECTIVES.items() if one.needs != "arm"])
def test_every_objective_has_a_size(key: str) -> None:
    assert OBJECTIVES[key].sized(Sizes(STUDY, 6.0)) > 0.0


def test_each_cap_and_each_limit_of_a_drive_is_a_key() -> None:
    caps = {field.name for field in dataclasses.fields(Caps)}
    of_the_drive = {field.name for field in dataclasses.fields(Drive)}
    stated = [one.cap for one in QUANTITIES.values()]
    assert {cap.key for cap in stated if cap.key} <= caps
    assert caps - set(CAPPED.values()) == {"link_reversal"}  # checked, but no quantity
    assert {cap.limit for cap in stated if cap.limit} <= of_the_drive
    assert all(cap.key for cap in stated if cap.limit or cap.sought)


def test_the_caps_whose_least_is_sought_have_places_of_their_own() -> None:
    places = [QUANTITIES[key].cap.sought for key in HARD]
    assert places == list(range(1, len(places) + 1))
    assert HARD[:2] == ["peak-stall-force", "peak-force"]


def test_the_curve_of_the_drive_is_a_cap_of_one() -> None:
    assert cap_on(STUDY.caps, DRIVE, CURVE) == 1.0
    assert cap_on(STUDY.caps, dataclasses.replace(DRIVE, torque_speed=None), CURVE) is None
    assert math.isfinite(QUANTITIES[CURVE].history(ALONG).max())
