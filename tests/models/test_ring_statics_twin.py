"""The twin of the forces in the ring: against virtual work, the equation of motion and by hand."""

import dataclasses
import math

import numpy as np
import pytest

from models import truss
from models.truss.kinematics import link_ratio
from tests.models.ring_statics_twin import ring_forces, ring_motion, rope_tensions

JOINTS = truss.JointMasses(bar_end=0.02, middle=0.03, crank=0.005, slider=0.04)
ROUNDING = 1e-9  # [N]: forces of up to 1e3 N by a system whose condition is at most 1e4
RIDGE = math.radians(84.34)


def truss_of(modules, mu=0.0, **others):
    return dataclasses.replace(
        truss.DYNAMIC_SET, modules=modules, pulley_friction=mu, joint_masses=JOINTS, **others
    )


def potential_of_members(parameters, angle, inner=0.0, outer=0.0, link=0.0, kink=0.0):
    """U [J] at fixed rope lengths, if all members of a kind grow [m] or bend at the crank [rad].

    A longer half cross-bar takes rope from the sliders. The net keeps its own radius.
    """
    n, c = parameters.modules, parameters.crank + inner
    rest, d = parameters.half_cross_bar - parameters.crank + outer, parameters.link + link
    bar = np.sqrt(c**2 + rest**2 + 2 * c * rest * np.cos(kink))
    height = np.sqrt(parameters.link**2 - (parameters.crank * np.sin(angle)) ** 2)
    e = parameters.crank * np.cos(angle) + height + parameters.half_cross_bar - bar

    alpha = np.arccos((e**2 + c**2 - d**2) / (2 * e * c))
    radius = (c * np.sin(alpha) + rest * np.sin(alpha + kink)) / np.sin(np.pi / n)
    taut = parameters.half_cross_bar * np.sin(parameters.net_angle) / np.sin(np.pi / n)
    net = parameters.net_stiffness * (radius - taut) ** 2 if angle > parameters.net_angle else 0.0
    return n * (parameters.spring_stiffness * (parameters.spring_free_length - e) ** 2 + net)


@pytest.mark.parametrize("modules", [5, 6])
@pytest.mark.parametrize("angle_deg", [20.0, 79.0, 84.34, 89.0])
@pytest.mark.parametrize(
    ("force", "growth"),
    [("inner", "inner"), ("outer", "outer"), ("link", "link"), ("bending", "kink")],
)
def test_virtual_work_of_like_members(modules, angle_deg, force, growth):
    parameters, angle = truss_of(modules), math.radians(angle_deg)
    step = 1e-30  # of a derivative by a complex step, which knows no cancellation
    slope = potential_of_members(parameters, angle, **{growth: 1j * step}).imag / step
    each = getattr(ring_forces(parameters, angle), force)
    np.testing.assert_allclose(each, slope / (4 * modules), rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("angle_deg", [20.0, 84.34])
def test_bending_jumps_at_the_crank_by_the_friction_of_its_joint(angle_deg):
    """Both parts of a half cross-bar, each with its inertia, say the same of the cut in motion."""
    parameters, angle, rate = truss_of(6, 0.02), math.radians(angle_deg), 0.4
    forces = ring_forces(parameters, angle, rate, 0.7)
    turn = rate * (1 + float(link_ratio(parameters, angle)))
    # it holds the cross-bar back, so less than the inner part gives is left for the outer one
    jump = forces.bending[..., 1] - forces.bending[..., 0]
    np.testing.assert_allclose(jump, -parameters.joint_friction * turn, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("modules", [3, 6, 7])
@pytest.mark.parametrize("mu", [0.0, 0.03])
@pytest.mark.parametrize("angle_deg", [4.4, 47.0, 79.0, 81.0, 86.0, 90.0])
def test_force_at_rest_is_static_force(modules, mu, angle_deg):
    parameters, angle = truss_of(modules, mu), math.radians(angle_deg)
    forces = ring_forces(parameters, angle)
    assert forces.residual < ROUNDING
    assert forces.motor_force == pytest.approx(
        float(truss.static_force(parameters, angle)), rel=1e-11
    )
    np.testing.assert_allclose(forces.reaction, 0, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("counting", ["once", "as printed"])
@pytest.mark.parametrize("modules", [3, 6])
@pytest.mark.parametrize("angle_deg", [4.4, 47.0, 84.34, 90.0])
def test_force_in_motion_is_that_of_the_equation_of_motion(counting, modules, angle_deg):
    """So the shear closes round the ring with the same T1, at any rate and acceleration."""
    parameters, angle = truss_of(modules, 0.02, counting=counting), math.radians(angle_deg)
    for rate, acceleration in ((0.4, 0.0), (0.0, 0.7), (0.3, -0.2)):
        forces = ring_forces(parameters, angle, rate, acceleration)
        expected = float(truss.rope_force(parameters, angle, rate, acceleration))
        assert forces.residual < ROUNDING
        assert forces.motor_force == pytest.approx(expected, rel=1e-11)

        # the whole ring is held by its fixed bar, without a moment about the bar's middle
        towards_centre = np.array([math.sin(math.pi / modules), math.cos(math.pi / modules), 0])
        held = float(truss.reaction_force(parameters, angle, rate, acceleration))
        np.testing.assert_allclose(
            forces.reaction[:3], held * towards_centre, rtol=0, atol=ROUNDING
        )
        np.testing.assert_allclose(forces.reaction[3:], 0, rtol=0, atol=ROUNDING)


def test_tensions_are_those_of_the_model():
    parameters = truss_of(6, 0.05)
    expected = truss.tension_ratios(parameters, RIDGE).full().ravel()
    for rope in rope_tensions(parameters, ring_motion(parameters, RIDGE, 0, 0)):
        np.testing.assert_allclose(rope.ravel(), expected, rtol=1e-13)


@pytest.mark.parametrize("angle_deg", [4.4, 47.0, 84.34])
def test_links_and_shear_by_hand(angle_deg):
    """Balance of a slider and, about the bar end, of a half cross-bar, at rest with friction."""
    parameters, angle = truss_of(6, 0.03), math.radians(angle_deg)
    forces = ring_forces(parameters, angle)
    link = math.asin(parameters.crank * math.sin(angle) / parameters.link)

    # links of both modules at a slider: rope and motor up, spring down
    tension = forces.motor_force * truss.tension_ratios(parameters, angle).full().reshape(6, 4)
    squeeze = parameters.spring_free_length - float(truss.slider_distance(parameters, angle))
    up = tension[:, 0] + np.roll(tension[:, 3], 1) - parameters.spring_stiffness * squeeze
    pushed = forces.link[:, 0] + np.roll(forces.link[:, 1], 1)
    np.testing.assert_allclose(pushed * math.cos(link), up, rtol=0, atol=ROUNDING)

    # both link and shear lift the left half, so the shear relieves its link; it presses the right
    # half down as much. The thrust of the net, which is left, is the same everywhere.
    arm = parameters.half_cross_bar * math.sin(angle)
    lever = parameters.crank * math.sin(angle + link)
    difference = forces.link[:, 1] - forces.link[:, 0]
    np.testing.assert_allclose(
        difference * lever, 2 * arm * forces.shear[:, 0], rtol=0, atol=ROUNDING
    )
    np.testing.assert_allclose(
        forces.link.sum(axis=1), 4 * forces.link.mean(), rtol=0, atol=ROUNDING
    )


def test_stress_without_load_is_taken_out():
    """Least link forces leave no shear all the way round, and the lower half mirrors the upper."""
    parameters = truss_of(6, 0.03)
    flat = ring_forces(parameters, RIDGE, 0.3, 0.2)
    bent = ring_forces(parameters, RIDGE, 0.3, 0.2, faces_bend=True)
    for forces in (flat, bent):
        assert forces.stresses == 5
        np.testing.assert_allclose(forces.shear.sum(axis=0), 0, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(forces.shear.sum(axis=1), 0, rtol=0, atol=ROUNDING)
    assert bent.motor_force == pytest.approx(flat.motor_force, rel=1e-11)
    assert np.linalg.norm(bent.link) < np.linalg.norm(flat.link)


@pytest.mark.slow
def test_known_figures_of_the_reference_set():
    """An earlier reading, by another hand, to the digits it was noted with."""
    smooth = ring_forces(truss.DYNAMIC_SET, RIDGE)
    assert smooth.motor_force == pytest.approx(20.07, abs=0.005)
    for name, value in (("link", 14.93), ("outer", 47.18), ("inner", 38.43)):
        np.testing.assert_allclose(getattr(smooth, name), value, rtol=0, atol=0.005)
    np.testing.assert_allclose(smooth.shear, 0, rtol=0, atol=ROUNDING)

    rubbing = dataclasses.replace(truss.DYNAMIC_SET, pulley_friction=0.01)
    rough = ring_forces(rubbing, RIDGE)
    assert rough.motor_force == pytest.approx(39.64, abs=0.005)
    assert (rough.link.min(), rough.link.max()) == pytest.approx((-134, 164), abs=0.5)
    # the documents state what faces that bend out of their plane would carry
    bent = ring_forces(rubbing, RIDGE, faces_bend=True)
    assert (bent.link.min(), bent.link.max()) == pytest.approx((-34, 67), abs=0.5)
