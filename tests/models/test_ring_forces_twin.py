"""Forces in the bars against the balance of every body of the ring, by another author.

The twin lets the ring's centre move, as the fixed bar makes it; the models leave out what bends the
ring by that. The two agree in all modules if the radius has no acceleration, and else on average.
"""

import math

import numpy as np
import pytest

from models import truss
from models.truss.kinematics import link_ratio
from tests.models import ring_statics_twin
from tests.seeds import seeds

SHARE = 1e-8  # of the largest force


def drawn(seed: int) -> tuple[truss.TrussParameters, float, float]:
    """A truss with all frictions and masses, an angle and a speed."""
    draw = np.random.default_rng(seed)
    crank = draw.uniform(0.06, 0.14)
    parameters = truss.TrussParameters(
        modules=int(draw.integers(3, 13)),
        bar_length=draw.uniform(0.9, 1.4),
        half_cross_bar=draw.uniform(0.3, 0.44),
        crank=crank,
        link=crank * draw.uniform(1.2, 2.0),
        spring_stiffness=draw.uniform(20, 400),
        spring_free_length=draw.uniform(0.43, 0.5),
        net_stiffness=draw.uniform(50, 500),
        net_angle=math.radians(draw.uniform(60, 80)),
        joint_friction=draw.uniform(0, 1),
        slider_friction=draw.uniform(0, 9),
        pulley_friction=draw.uniform(0, 0.05),
        linear_density=draw.uniform(0.05, 2),
        joint_masses=truss.JointMasses(*draw.uniform(0, 1, 4)),
        counting=draw.choice(["once", "as printed"]),
    )
    return parameters, draw.uniform(0.1, 1.5), draw.uniform(0, 2)


def both(parameters, angle, speed, acceleration):
    """Forces of models and twin, (4, n, 4): link, inner, outer part, moment at the crank."""
    twin = ring_statics_twin.ring_forces(parameters, angle, speed, acceleration)
    own = truss.ring_forces(parameters, [angle], [speed], [acceleration])
    kinds = (own.bars["link"], own.bars["inner_cross_bar"], own.bars["outer_cross_bar"])
    # upper and lower face, left and right half
    found = [np.tile(kind[0], 2) for kind in (*kinds, own.crank_moment)]
    # the models' mean along a link is below the mean of its ends, as it turns
    mass = parameters.linear_density * parameters.link
    turn = float(link_ratio(parameters, angle)) * speed
    found[0] += mass * parameters.link * turn**2 / 12
    # the twin's moment is positive if it opens the outer part further
    return np.array(found), np.array([twin.link, twin.inner, twin.outer, twin.bending[..., 1]])


@pytest.mark.parametrize("seed", seeds(15, 50))
def test_all_modules_carry_what_the_twin_says(seed: int) -> None:
    """At rest, and at a speed at which the radius has no acceleration."""
    parameters, angle, speed = drawn(seed)
    for rate in (0.0, speed):
        found, twin = both(parameters, angle, rate, math.tan(angle) * rate**2)
        np.testing.assert_allclose(found, twin, rtol=0, atol=SHARE * np.abs(twin).max())


@pytest.mark.parametrize("seed", seeds(15, 50))
def test_the_mean_of_all_modules_is_that_of_the_twin(seed: int) -> None:
    parameters, angle, speed = drawn(seed)
    found, twin = both(parameters, angle, speed, 2 * math.sin(seed))
    size = np.abs(twin).max()
    np.testing.assert_allclose(found.mean(axis=1), twin.mean(axis=1), rtol=0, atol=SHARE * size)


@pytest.mark.parametrize("seed", range(10))
def test_the_motor_force_is_that_of_the_twin(seed: int) -> None:
    parameters, angle, speed = drawn(seed)
    twin = ring_statics_twin.ring_forces(parameters, angle, speed, 1.0)
    expected = float(truss.rope_force(parameters, angle, speed, 1.0))
    assert twin.motor_force == pytest.approx(expected, rel=SHARE)


@pytest.mark.parametrize("seed", range(10))
def test_vertical_bars_carry_what_lifts_the_upper_face(seed: int) -> None:
    """On average over the ring, with the accelerations of the twin; at rest they carry nothing."""
    parameters, angle, speed = drawn(seed)
    rho, masses = parameters.linear_density, parameters.joint_masses
    shared = 1 if parameters.counting == "once" else 2
    for state in ((0.0, 0.0), (speed, 2 * math.sin(seed))):
        own = truss.ring_forces(parameters, [angle], [state[0]], [state[1]]).vertical_bar[0]
        up = ring_statics_twin.ring_motion(parameters, angle, *state).acceleration[0, :, 2]
        lifted = rho * parameters.half_cross_bar * (up[1] + 2 * up[6] + up[5]) / 2
        lifted += rho * parameters.link * (up[7] + up[8] + up[13] + up[14]) / 2
        lifted += masses.middle * up[6] + masses.crank * (up[7] + up[13])
        lifted += shared * masses.slider * up[8]
        assert own.mean() == pytest.approx(lifted, abs=SHARE * np.abs(own).max())
