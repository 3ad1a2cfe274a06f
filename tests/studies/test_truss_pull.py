"""Times that no motion beats because ropes only pull."""

import dataclasses
import math
import warnings

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.laws import RateCaps, least_time
from models.truss import DYNAMIC_SET
from studies.common.result import Result
from studies.truss.config import as_dictionary, study_from
from studies.truss.figures import with_friction
from studies.truss.limits.caps import Caps
from studies.truss.limits.pull import least_time_of_pull, push_of_springs
from studies.truss.motions.laws import paper_laws, study_of
from studies.truss.motions.phase_plane import PhasePlane

STROKE = math.pi / 2 - DYNAMIC_SET.stowed_angle


@pytest.mark.slow
@settings(max_examples=5, deadline=None)
@given(
    jerk=st.floats(-5, -2).map(lambda power: 10**power),
    share=st.floats(0.3, 1.5),
    speed=st.floats(0.3, 1.5),
)
def test_slow_motions_are_bound_by_the_rates_alone(jerk, share, speed):
    free = least_time(STROKE, RateCaps(jerk=jerk))
    # shares of the peaks that the motion under the jerk cap alone has
    rates = (speed * 2 * STROKE / free, share * jerk * free / 4, jerk)
    exact = least_time(STROKE, RateCaps(*rates))
    caps = Caps(**dict(zip(("speed", "acceleration", "jerk"), rates, strict=True)))
    bound = least_time_of_pull(DYNAMIC_SET, caps, None, enough=0.0)
    assert bound <= exact
    # cells of the highest speed cost about a hundredth
    assert bound >= 0.98 * exact


@pytest.mark.parametrize("mu", [0.0, 0.01])
@pytest.mark.parametrize("force", [60.0, 100.0])
def test_under_a_force_cap_alone_it_is_that_of_the_phase_plane(mu, force):
    truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=mu)
    exact = PhasePlane(truss).least_time(force)
    bound = least_time_of_pull(truss, Caps(), force, enough=0.0)
    assert exact * (1 - 3e-4) <= bound <= exact  # 1e-4 is taken off, the steps cost the rest


@pytest.mark.slow
def test_every_cap_only_adds_to_the_time():
    loose = least_time_of_pull(DYNAMIC_SET, Caps(jerk=100.0), 100.0, enough=0.0)
    for caps, force in ((Caps(jerk=60.0), 100.0), (Caps(jerk=100.0, speed=1.5), 100.0)):
        assert least_time_of_pull(DYNAMIC_SET, caps, force, enough=0.0) > loose
    assert least_time_of_pull(DYNAMIC_SET, Caps(jerk=100.0), 60.0, enough=0.0) > loose


def test_springs_that_pull_first_push_the_truss():
    held = push_of_springs(DYNAMIC_SET, Caps(acceleration=1.0))
    assert held.acceleration < 0.0
    with pytest.warns(UserWarning, match="pulls at first"):
        short = dataclasses.replace(DYNAMIC_SET, spring_free_length=0.2)
    assert push_of_springs(short, Caps(acceleration=1.0)).acceleration > 0.0


def test_a_stored_study_is_read_without_a_warning_that_was_said_before():
    asked = {"duration": 6.0, "minimise": "peak-acceleration", "truss": {"spring_free_length": 0.2}}
    with pytest.warns(UserWarning, match="pulls at first"):
        configuration = as_dictionary(study_from(asked))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        stored = study_of(Result("truss", "a question", configuration))
        with_friction(paper_laws(stored.truss, 6.0)[0], 0.0)  # as figures show it
    assert stored.truss.spring_free_length == 0.2
