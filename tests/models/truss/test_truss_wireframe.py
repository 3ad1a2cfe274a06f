"""The antenna as points and lines, held against the kinematics and the rope of the model."""

import dataclasses

import casadi as ca
import numpy as np
import pytest

from models.truss import DYNAMIC_SET, ring_positions, rope_length, tension_ratios
from models.truss.wireframe import shape_weights, tension_exponents, wireframe

ANGLES = np.linspace(DYNAMIC_SET.stowed_angle, np.pi / 2, 10)
FRAME = wireframe(DYNAMIC_SET)
ROUNDING = 1e-13  # [m], of sums of some dozens of terms of 10 m


@pytest.mark.parametrize("angle", ANGLES)
def test_points_are_the_nodes_of_the_model(angle):
    points = FRAME.points(shape_weights(DYNAMIC_SET, angle))[0]
    nodes = ring_positions(DYNAMIC_SET, float(angle)).reshape(-1, 3)
    assert np.abs(points[: len(nodes)] - nodes).max() < ROUNDING
    # the middle of the ring, at half height
    ends = ring_positions(DYNAMIC_SET, float(angle))[:, :2].reshape(-1, 3)
    assert points[FRAME.centre] == pytest.approx(ends.mean(axis=0), abs=ROUNDING)


@pytest.mark.parametrize("angle", ANGLES)
def test_the_paths_of_both_ropes_are_as_long_as_the_rope(angle):
    points = FRAME.points(shape_weights(DYNAMIC_SET, angle))[0]
    length = float(rope_length(DYNAMIC_SET, float(angle)))  # (20)
    for rope in FRAME.ropes:
        segments = np.linalg.norm(np.diff(points[rope], axis=0), axis=1)
        assert segments.sum() == pytest.approx(length, abs=ROUNDING)


def test_exponents_give_the_tensions_along_the_rope():
    truss = dataclasses.replace(
        wireframe_parameters(mu=0.01), other_pulleys=((1, 4, 0.2), (24, 3, 0.0), (7, 2, 0.3))
    )
    exponents = tension_exponents(truss)
    for angle in ANGLES:
        ratios = ca.DM(tension_ratios(truss, float(angle))).full().ravel()  # (29)
        assert np.exp(exponents @ [1.0, angle]) == pytest.approx(ratios, rel=1e-14)


def wireframe_parameters(mu):
    return dataclasses.replace(DYNAMIC_SET, pulley_friction=mu)


def test_every_part_is_there_once():
    n = DYNAMIC_SET.modules
    counts = {kind: len(pairs) for kind, pairs in FRAME.lines.items()}
    # two faces of the net: n spokes and two rings each; the edges of the motor's box
    assert counts == {
        "vertical bars": n,
        "cross-bars": 4 * n,
        "links": 4 * n,
        "net": 2 * 3 * n,
        "arm": 1,
        "motor": 12,
    }
    points = FRAME.points(shape_weights(DYNAMIC_SET, 1.0))[0]
    ends = {
        tuple(np.sort(np.round(points[pair], 9), axis=0).ravel())
        for kind in ("vertical bars", "cross-bars", "links")
        for pair in FRAME.lines[kind]
    }
    assert len(ends) == 9 * n
