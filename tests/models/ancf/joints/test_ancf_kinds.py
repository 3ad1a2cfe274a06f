"""The laws of joints as the integrator asks for them."""

import numpy as np

from models.ancf.joints import Driven, LastAsked, Locked
from models.ancf.joints.elimination import SlopeElimination
from models.ancf.joints.ties import SlopeTie


def test_a_law_is_asked_once_for_the_same_instants():
    asked = []

    def law(t):
        asked.append(t)
        return 2.0 * t

    kept, first, second = LastAsked(law), np.array([1.0, 2.0]), np.array([3.0, 4.0])
    for t in (first, first, second, second, first):
        assert np.array_equal(kept(t), 2.0 * t)
    assert len(asked) == 3


def test_a_locked_joint_is_one_that_is_driven_and_stands_still():
    rng, t = np.random.default_rng(0), np.linspace(0.0, 1.0, 3)
    z, v, a = rng.normal(size=(3, 7, 3))
    force = rng.normal(size=(8, 3))

    def eliminated(joint):
        map_ = SlopeElimination((SlopeTie(1, [2, 3], [4, 5], joint),), 8)
        moved = map_.motion(t, z, v, a)
        return (*moved, map_.force(t, moved[0], force))

    locked = eliminated(Locked(0.7))
    driven = eliminated(Driven(lambda t: 0.7 + 0 * t, lambda t: 0 * t, lambda t: 0 * t))
    for one, other in zip(locked, driven, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-14)
