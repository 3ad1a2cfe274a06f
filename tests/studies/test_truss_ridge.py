"""The force that every motion needs at the ridge where caps bound what its inertia saves."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.truss import (
    DYNAMIC_SET,
    inertia,
    inertia_slope,
    joint_damping,
    potential_slope,
    rope_leverage,
    static_peak,
)
from studies.cli import main
from studies.common.exit_codes import ExitCode
from studies.margin import MarginRequirements
from studies.margin.loads import least_static_need
from studies.truss.config import TrussStudy
from studies.truss.limits.bounds import lower_bounds
from studies.truss.limits.caps import Caps
from studies.truss.limits.ridge import ridge_force, ridge_need
from studies.truss.motions.laws import paper_laws
from studies.truss.motions.phase_plane import PhasePlane

MU = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01)


# The optima are those of tests/studies/test_truss_force.py. What is left between bound and optimum
# is the way of the inertia before and after the ridge, which the bound does not follow.
@pytest.mark.parametrize(
    ("duration", "optimum", "gap"), [(140.0, 39.64421, 2e-5), (5.0, 44.53408, 0.2)]
)
def test_known_optima_are_above_the_bound(duration: float, optimum: float, gap: float) -> None:
    bound = ridge_force(MU, Caps(jerk=200 / duration**3))
    assert bound is not None
    assert optimum * (1 - gap) < bound.force < optimum


@pytest.mark.slow
@given(
    duration=st.floats(2.0, 300.0),
    friction=st.floats(0.0, 0.05),
    rate=st.sampled_from(["jerk", "acceleration", "speed"]),
)
@settings(max_examples=40, deadline=None)
def test_no_law_of_the_paper_beats_it_under_its_own_peaks(
    duration: float, friction: float, rate: str
) -> None:
    truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=friction)
    for law in paper_laws(truss, duration):
        peaks = {name: law.values[f"peak-{name}"] for name in {"jerk", rate}}
        bound = ridge_force(truss, Caps(**peaks))
        assert bound is not None
        assert bound.force <= law.values["peak-force"]


@pytest.mark.parametrize("duration", [3.0, 4.0])
def test_the_fastest_motions_of_the_phase_plane_do_not_beat_it(duration: float) -> None:
    least = PhasePlane(DYNAMIC_SET).least_force(duration)
    bound = ridge_force(DYNAMIC_SET, Caps(acceleration=least.motion.peak_acceleration))
    assert bound is not None
    assert bound.force < least.force


@given(
    jerk=st.floats(1e-4, 1e3),
    acceleration=st.none() | st.floats(1e-3, 1e2),
    speed=st.none() | st.floats(0.01, 10.0),
)
@settings(max_examples=40, deadline=None)
def test_it_is_the_least_of_all_speeds_at_its_angle(
    jerk: float, acceleration: float | None, speed: float | None
) -> None:
    bound = ridge_force(MU, Caps(jerk=jerk, acceleration=acceleration, speed=speed))
    assert bound is not None
    terms = (potential_slope, inertia_slope, joint_damping, inertia, rope_leverage)
    slope, change, damping, mass, leverage = (float(term(MU, bound.angle)) for term in terms)

    way = min(bound.angle - MU.stowed_angle, math.pi / 2 - bound.angle)
    top = jerk / 2 * (6 * way / jerk) ** (2 / 3)
    top = min(top, math.inf if speed is None else speed)
    top = min(top, math.inf if acceleration is None else math.sqrt(2 * acceleration * way))

    def forces(roots: np.ndarray) -> np.ndarray:
        omega = roots**2
        back = np.minimum(np.sqrt(2 * jerk * omega), acceleration or math.inf)
        return (slope + change * omega**2 / 2 + damping * omega - mass * back) / leverage

    # sampled over the root of the speed, then between the neighbours of the least sample
    roots = np.linspace(0.0, math.sqrt(top), 20001)
    k = int(np.argmin(forces(roots)))
    finer = np.linspace(roots[max(k - 1, 0)], roots[min(k + 1, 20000)], 20001)
    size = np.abs(forces(roots)).max()  # rounding counts against the terms that cancel
    assert forces(finer).min() == pytest.approx(bound.force, rel=1e-9, abs=1e-12 * size)


def test_slow_motions_are_bounded_by_the_statics() -> None:
    slow = ridge_force(MU, Caps(jerk=100 / 1e4**3))
    assert slow is not None
    # the grid of angles misses the static ridge by at most half a step
    assert slow.force == pytest.approx(static_peak(MU).force, rel=1e-6)
    assert slow.force < static_peak(MU).force


def test_without_caps_on_rates_there_is_none() -> None:
    assert ridge_force(MU, Caps(speed=1.0)) is None


def test_a_force_cap_below_it_is_refused_with_the_proof(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = "--objective time --duration 2..60 --force-cap 39.5 --jerk-cap 0.5 --friction 0.01"
    assert main(["truss", *words.split()]) == ExitCode.INFEASIBLE
    error = capsys.readouterr().err
    assert "under the jerk cap needs at least" in error
    assert "39.637" in error


FACTORED = MarginRequirements(
    static=0.0,
    dynamic=0.25,
    factors={"inertia": 1.1, "springs": 1.2, "net": 1.2, "joint_friction": 1.5},
    cases={"cold": {"joint_friction": 0.3}, "end": {"derating": {"ageing": 0.9}, "holding": 1.0}},
)


@pytest.mark.parametrize("duration", [4.0, 10.0, 140.0])
def test_no_law_of_the_paper_needs_less_motor_than_the_bound(duration: float) -> None:
    for law in paper_laws(MU, duration, margin=FACTORED):
        peaks = {name: law.values[f"peak-{name}"] for name in ("acceleration", "jerk")}
        bound = ridge_need(FACTORED, MU, Caps(**peaks))
        assert bound is not None
        assert bound.force <= law.values["peak-factored-force"]
        # with 25 % in motion and none at rest it says more than statics and the plain force do
        asked = {"minimise": "peak-factored-force", "duration": duration, "margin": FACTORED}
        study = TrussStudy(**asked, truss=MU, caps=Caps(**peaks))
        assert lower_bounds(study, None)["peak-factored-force"] == bound.force
        assert bound.force > 1.2 * least_static_need(FACTORED, MU)


def test_without_factors_a_need_is_the_force_times_the_margin() -> None:
    caps, plain = Caps(jerk=0.2, acceleration=0.3), MarginRequirements(dynamic=0.25)
    need, force = ridge_need(plain, MU, caps), ridge_force(MU, caps)
    assert need is not None
    assert force is not None
    # two ways through the same formulas: rounding of terms that cancel
    assert need.force == pytest.approx(1.25 * force.force, rel=1e-10)
    assert need.angle == force.angle
