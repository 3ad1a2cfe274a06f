"""Parameters and motions outside the range of the model are refused in one sentence."""

import dataclasses
import math
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from models import truss
from models.errors import ModelError
from models.numerics import dense_peak

BAD = {
    "modules": [2, 0, -3, 4.0, "24", math.nan],
    "bar_length": [0.0, -1.0, math.inf, math.nan, "1", None, 0.5],
    "half_cross_bar": [0.0, 0.05, 0.51],
    "crank": [0.0, 0.15, 0.2],
    "link": [0.1, 0.05, 0.6],
    "stowed_angle": [0.0, -0.1, 1.5],
    "net_angle": [0.05, math.pi / 2, 80.0],
    "spring_stiffness": [-1.0, math.nan],
    "net_stiffness": [-1.0],
    "spring_free_length": [0.0],
    "joint_friction": [-0.1],
    "slider_friction": [-0.1],
    "pulley_friction": [-0.01, math.inf, True],
    "linear_density": [0.0],
    "counting": ["twice", ""],
    "joint_masses": [0.0],
}
CASES = [(name, value) for name, values in BAD.items() for value in values]


@pytest.mark.parametrize(("name", "value"), CASES)
def test_bad_parameters(name, value):
    with pytest.raises(ModelError) as caught:
        dataclasses.replace(truss.DYNAMIC_SET, **{name: value})
    message = str(caught.value)
    assert message.endswith(".")
    assert ";" in message  # what is wrong; what to do


@pytest.mark.parametrize("name", ["bar_end", "middle", "crank", "slider"])
def test_bad_joint_masses(name):
    with pytest.raises(ModelError, match=name):
        truss.JointMasses(**{name: -1.0})


def test_a_spring_that_pulls_is_warned_of():
    with pytest.warns(UserWarning, match="spring_free_length 0.2 m"):
        dataclasses.replace(truss.DYNAMIC_SET, spring_free_length=0.2)


def test_unknown_symbols_are_refused():
    for name in ("modules", "counting", "colour"):
        with pytest.raises(ModelError, match=name):
            truss.with_symbols(truss.DYNAMIC_SET, **{name: 1})


@given(
    b=st.floats(0.1, 2.0),
    c=st.floats(0.01, 1.0),
    ratio=st.floats(1.01, 3.0),
    stowed=st.floats(0.01, 1.0),
    modules=st.integers(3, 60),
)
def test_accepted_parameters_give_a_truss_that_moves(b, c, ratio, stowed, modules):
    d = ratio * c
    e0 = c * math.cos(stowed) + math.sqrt(d**2 - (c * math.sin(stowed)) ** 2)
    a = 1.001 * max(2 * e0, 2 * b * math.cos(stowed))
    values = {
        "bar_length": a,
        "half_cross_bar": b,
        "crank": c,
        "link": d,
        "stowed_angle": stowed,
        "modules": modules,
        "spring_free_length": 1.1 * e0,
    }

    if c > b:
        with pytest.raises(ModelError, match="crank"):
            dataclasses.replace(truss.DYNAMIC_SET, **values)
        return
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        p = dataclasses.replace(truss.DYNAMIC_SET, **values)

    for alpha in np.linspace(stowed, math.pi / 2, 7):
        assert truss.inertia(p, alpha) > 0
        assert truss.rope_leverage(p, alpha) > 0
        assert truss.joint_damping(p, alpha) > 0

    lengths = [truss.rope_length(p, alpha) for alpha in np.linspace(stowed, math.pi / 2, 7)]
    assert np.all(np.diff(lengths) < 0)
    back = truss.angle_from_rope_length(p, lengths)
    # The angle is an arc cosine: near zero its error is rounding over the angle, and the square
    # of the lengths' ratio for links much longer than the cranks.
    assert back == pytest.approx(np.linspace(stowed, math.pi / 2, 7), abs=1e-10 * (b / c) ** 2)


def test_rope_lengths_out_of_reach():
    for length in (10.0, 40.0, math.nan):
        with pytest.raises(ModelError, match="out of reach"):
            truss.angle_from_rope_length(truss.DYNAMIC_SET, [length])


def test_motion_backwards_against_pulley_friction():
    p = dataclasses.replace(truss.DYNAMIC_SET, pulley_friction=0.01)
    with pytest.raises(ModelError, match="keep the speed non-negative"):
        truss.evaluate_motion(p, [1.0, 1.0], [0.1, -0.01], [0.0, 0.0])
    truss.evaluate_motion(truss.DYNAMIC_SET, [1.0], [-0.01], [0.0])


@pytest.mark.parametrize(
    ("angle", "speed", "match"),
    [
        ([0.0], [0.0], "keep it in"),
        ([1.6], [0.0], "keep it in"),
        ([math.nan], [0.0], "not finite"),
        ([1.0, 1.1], [0.0], "one length"),
        ([], [], "one length"),
    ],
)
def test_motions_outside_the_model(angle, speed, match):
    with pytest.raises(ModelError, match=match):
        truss.evaluate_motion(truss.DYNAMIC_SET, angle, speed, [0.0] * len(speed))


def test_choices_are_checked():
    with pytest.raises(ModelError, match="slack"):
        truss.potential(truss.DYNAMIC_SET, 1.0, "loose")
    with pytest.raises(ModelError, match="1 to 14"):
        truss.node_position(truss.DYNAMIC_SET, 15, 1.0)
    for module in (0, 25):
        with pytest.raises(ModelError, match="1 to 24"):
            truss.node_position(truss.DYNAMIC_SET, 1, 1.0, module=module)
    with pytest.raises(ModelError, match="empty"):
        dense_peak(np.sin, 1.0, 1.0)
    with pytest.raises(ModelError, match="at least 3"):
        dense_peak(np.sin, 0.0, 1.0, samples=2)
