"""What the forces in the bars of all modules add to a result."""

import dataclasses
import math

import numpy as np
import pytest

from models.laws import Bezier
from models.truss import DYNAMIC_SET
from studies.truss.bars import bars_of
from studies.truss.figures import bar_forces_figure
from studies.truss.limits.caps import Caps
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import paper_laws

T = 140.0


def slow(friction: float = 0.01, **changes: float) -> Deployment:
    """The Bezier law of the paper, all but at rest."""
    truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=friction, **changes)
    return paper_laws(truss, T)[0]


def test_a_limit_on_reversal_is_a_check() -> None:
    """3.7 N: six of 48 links are both pushed and pulled at rest under any law."""
    for limit, passed in ((3.0, False), (4.0, True)):
        parts = bars_of(slow(), Caps(link_reversal=limit))
        (check,) = (one for one in parts.checks if one.name == "reversal of a link")
        assert check.passed == passed
        assert check.value == pytest.approx(3.74, abs=0.02)
    assert any(said.startswith("6 of the 48 links of a face") for said in parts.sentences)


def test_self_stress_is_told_only_with_friction() -> None:
    assert any("best self-stress" in said for said in bars_of(slow(), Caps()).sentences)
    assert not any("self-stress" in said for said in bars_of(slow(0.0), Caps()).sentences)


def test_a_bar_that_buckles_fails_a_check() -> None:
    for modulus, passed in ((70e9, True), (70e7, False)):
        parts = bars_of(slow(elastic_modulus=modulus), Caps())
        (check,) = parts.checks
        assert check.passed == passed
        assert check.sentence.endswith("caps.buckling_load = 1") != passed
    # the largest push in a cross-bar of 0.45 m, 144.4 N, against pi^2 E I / b^2
    stiffness = 70e9 * math.pi / 64 * (0.020**4 - 0.018**4)
    share = slow().values["peak-buckling-load"]
    assert share == pytest.approx(144.4 * (0.45 / np.pi) ** 2 / stiffness, rel=1e-3)


def test_an_angle_that_steps_back_is_drawn() -> None:
    """A motion of 117 s passed 90 deg by 1e-11 rad, and the map of the links warned of it."""
    start, end = DYNAMIC_SET.stowed_angle, math.pi / 2
    law = Bezier(T, (start, start, start, 0.8, 1.2, end, end + 1e-4, end, end))
    deployment = Deployment("optimal", law, DYNAMIC_SET)
    assert (np.diff(law.motion(np.linspace(0.0, T, 400)).angle) < 0).any()
    bar_forces_figure(deployment).draw_without_rendering()
