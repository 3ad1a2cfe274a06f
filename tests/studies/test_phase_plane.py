"""The phase-plane bound, against an independent integration over the angle."""

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from models.truss import (
    DYNAMIC_SET,
    TrussParameters,
    inertia,
    joint_damping,
    potential_slope,
    rope_leverage,
)
from studies.common.exit_codes import StudyError
from studies.truss.motions import phase_plane
from studies.truss.motions.phase_plane import PhasePlane

PLANES = {
    mu: PhasePlane(dataclasses.replace(DYNAMIC_SET, pulley_friction=mu)) for mu in (0.0, 0.01)
}


def energy_over_angle(truss: TrussParameters, force: float, backwards: bool):  # type: ignore[no-untyped-def]
    """K(alpha) with dK/dalpha = F f - U' - D omega, as a function of the angle."""
    alpha = ca.SX.sym("alpha")
    terms = [g(truss, alpha) for g in (rope_leverage, potential_slope, joint_damping, inertia)]
    evaluate = ca.Function("terms", [alpha], terms)

    def slope(a: float, k: np.ndarray) -> list[float]:
        f, u, d, j = map(float, evaluate(a))
        return [force * f - u - d * math.sqrt(max(2 * k[0] / j, 0.0))]

    ends = (truss.stowed_angle, math.pi / 2)
    span = ends[::-1] if backwards else ends
    found = solve_ivp(slope, span, [0.0], dense_output=True, rtol=1e-10, atol=1e-13, max_step=0.01)

    def speed(a: float) -> float:
        return math.sqrt(max(2 * float(found.sol(a)[0]) / float(evaluate(a)[3]), 0.0))

    return speed


@pytest.mark.parametrize("mu", [0.0, 0.01])
def test_least_time_agrees_with_integration_over_the_angle(mu: float) -> None:
    plane = PLANES[mu]
    truss, force = plane.parameters, 60.0
    motion = plane.fastest(force)
    assert motion is not None
    up, down = (energy_over_angle(truss, force * on, back) for on, back in ((1, False), (0, True)))
    # alpha = end -+ s^2 takes the square-root singularity out of dt = dalpha / omega
    middle = motion.switch_angle
    first = quad(
        lambda s: 2 * s / up(truss.stowed_angle + s * s),
        1e-4,
        math.sqrt(middle - truss.stowed_angle),
        limit=400,
    )[0]
    last = quad(
        lambda s: 2 * s / down(math.pi / 2 - s * s),
        1e-4,
        math.sqrt(math.pi / 2 - middle),
        limit=400,
    )[0]
    # the rough start of the square root in the independent integration leaves 1e-4
    assert first + last == pytest.approx(motion.duration, rel=3e-4)
    assert up(middle) == pytest.approx(down(middle), rel=1e-3)


@pytest.mark.parametrize(
    ("mu", "duration", "force"),
    [
        (0.0, 3.0, 21.10697),
        (0.0, 3.5, 16.64510),
        (0.0, 4.0, 13.78190),
        (0.01, 3.0, 61.53852),
        (0.01, 3.5, 48.24957),
        (0.01, 4.0, 39.70518),
    ],
)
def test_least_force_solves_for_the_duration(mu: float, duration: float, force: float) -> None:
    least = PLANES[mu].least_force(duration)
    assert least.attained
    assert least.force == pytest.approx(force, rel=1e-6)  # digits given
    assert least.motion.duration == pytest.approx(duration, rel=1e-9)
    assert least.motion.angle[-1] == pytest.approx(math.pi / 2, abs=1e-12)


@pytest.mark.parametrize(("mu", "angle"), [(0.0, 89.04), (0.01, 88.49)])
def test_long_durations_tend_to_a_limit_that_no_motion_attains(mu: float, angle: float) -> None:
    least = PLANES[mu].least_force(20.0)
    assert not least.attained
    assert f"{angle:.2f} deg" in least.sentence
    assert PLANES[mu].fastest(least.force * (1 - 1e-6)) is None


@pytest.mark.slow
def test_a_crawl_is_integrated_as_the_stiff_equation_that_it_is(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    truss = dataclasses.replace(DYNAMIC_SET, modules=6, pulley_friction=0.01)
    plane = PhasePlane(truss)
    least = plane.least_force(5.0)
    assert least.attained
    assert least.motion.duration == pytest.approx(5.0, rel=1e-5)  # of a crawl's integration

    # the explicit method, with as many evaluations as it takes
    monkeypatch.setattr(phase_plane, "MOST_EVALUATIONS", 10**7)
    slowly = PhasePlane(truss).least_time(least.force)
    assert slowly == pytest.approx(least.motion.duration, rel=1e-5)


def test_what_no_method_integrates_is_said(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    truss = dataclasses.replace(DYNAMIC_SET, modules=6, pulley_friction=0.01)
    monkeypatch.setattr(phase_plane, "MOST_EVALUATIONS", 100)
    monkeypatch.setattr(phase_plane, "MOST_OF_A_CRAWL", 100)
    with pytest.raises(StudyError, match="gives no bound"):
        PhasePlane(truss).least_force(5.0)


@pytest.mark.slow
def test_where_friction_makes_it_a_crawl_the_motion_beside_the_limit_is_found_farther_off():
    # 60 times the joint friction: at 1e-8 above the static limit the integration stalls
    truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01, joint_friction=6.0)
    plane = PhasePlane(truss)
    assert plane.fastest(plane.limit_force * (1 + phase_plane.NEAR_LIMIT)) is None
    least = plane.least_force(1.6)
    assert least.attained
    assert plane.least_time(least.force) == pytest.approx(1.6, rel=1e-6)

    slow = plane.least_force(2e4)
    assert not slow.attained
    assert slow.motion.force == pytest.approx(slow.force * (1 + 1e-7), rel=1e-9)
