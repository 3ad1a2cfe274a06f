"""Least peak force: the optima of the paper's truss with and without a cap on jerk."""

import io

import numpy as np
import pytest

from models.laws import JerkLimited
from models.truss import static_peak
from ocp import Ipopt, Settings
from studies.common.console import Console
from studies.paper.cases import WITH_FRICTION
from studies.truss.checks import criteria
from studies.truss.config import DEPLOYED, study_from
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import pinned_bezier
from studies.truss.search.best_motion import BestMotion
from studies.truss.search.motion_search import best_motion
from studies.truss.search.question import Question

D = DEPLOYED - WITH_FRICTION.stowed_angle
PINNED = pinned_bezier(WITH_FRICTION, 140.0)
BALANCE = 1e-8  # of the motor's work; the quadrature leaves 1e-14


def least_force(duration: float, mu: float, jerk: str | None, start: str = "bezier") -> BestMotion:
    """Least peak force from one start."""
    raw = {
        "minimise": "peak-force",
        "duration": duration,
        "caps": {} if jerk is None else {"jerk": jerk},
        "truss": {"pulley_friction": mu},
        "solver": {"starts": [start]},
    }
    return best_motion(Question(study_from(raw), Console(io.StringIO(), io.StringIO())))


def assert_energy_balances(deployment: Deployment) -> None:
    """Work of the motor = changes of energy + losses, at the end and at 20 times before."""
    e = deployment.energies
    miss = e.motor - e.kinetic - e.potential - e.joints - e.pulleys
    at = np.searchsorted(e.time, np.linspace(0, deployment.law.duration, 22)[1:])
    assert np.unique(at).size == 21
    assert np.abs(miss[at]).max() <= BALANCE * e.motor[-1]
    assert np.abs(miss).max() <= BALANCE * e.motor[-1]


def assert_peak_is_dense(outcome: BestMotion) -> None:
    """The solver's epigraph and the replay between the points agree; both are the table's."""
    ((_, epigraph, dense),) = outcome.solution.verification.peaks
    assert epigraph == pytest.approx(dense, rel=1e-6)
    # the table's law is integrated once more, from the jerk alone
    assert outcome.deployment.values["peak-force"] == pytest.approx(dense, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("mu", [0.0, 0.01])
def test_at_140_s_the_least_force_is_the_static_peak(mu: float) -> None:
    outcome = least_force(140.0, mu, "200/T^3")
    force = outcome.deployment.values["peak-force"]
    # physics of a slow motion: inertia is negligible and the ridge of U'/f is what is left
    assert force == pytest.approx({0.0: 20.0751, 0.01: 39.6438}[mu], rel=1e-4)
    assert force == pytest.approx(static_peak(outcome.deployment.truss).force, rel=1e-4)
    assert "slow" in outcome.verdict.sentence
    limit = Ipopt().max_iterations
    assert all(round_.iterations < limit for round_ in outcome.solution.mesh_iterations)
    assert_peak_is_dense(outcome)
    assert_energy_balances(outcome.deployment)


@pytest.mark.slow
def test_at_5_s_with_friction_the_least_force_is_the_reference() -> None:
    outcome = least_force(5.0, 0.01, "200/T^3")
    # reference by mesh convergence, by shooting on its structure, and from 130 starting laws
    assert outcome.deployment.values["peak-force"] == pytest.approx(44.53360, rel=1e-4)
    assert_peak_is_dense(outcome)
    assert_energy_balances(outcome.deployment)


@pytest.mark.slow
@pytest.mark.parametrize(("duration", "least"), [(5.0, 20.5590), (5.5, 20.3507)])
def test_without_friction_the_mesh_is_refined_to_its_tolerances(
    duration: float, least: float
) -> None:
    outcome = least_force(duration, 0.0, "200/T^3")
    # no reference: the least found so far, pinned so that a worse basin shows
    assert outcome.deployment.values["peak-force"] <= least * (1 + 1e-4)
    # at this optimum the solver wanders: rounds are started once more with another line search
    last = outcome.solution.mesh_iterations[-1]
    assert last.status in ("Solve_Succeeded", "Stood_Still_Near_Optimum")
    # the answer is the best round, and not always the last
    solution, asked = outcome.solution, Settings().accuracy.path
    if solution.verification.excess > asked:
        # last digits in which the objective no longer moves; the verdict names them
        assert solution.verification.excess <= 10 * asked
        assert "the constraints are met to" in solution.verdict
    assert_peak_is_dense(outcome)
    assert_energy_balances(outcome.deployment)


@pytest.mark.slow
@pytest.mark.parametrize("mu", [0.0, 0.01])
@pytest.mark.parametrize("duration", [3.0, 3.5, 4.0])
def test_without_a_jerk_cap_the_phase_plane_is_met(duration: float, mu: float) -> None:
    outcome = least_force(duration, mu, None)
    bound = outcome.bounds["peak-force"]  # F with T_min(F) = T, global
    force = outcome.deployment.values["peak-force"]
    assert force == pytest.approx(bound, rel=1e-4)
    assert outcome.verdict.kind == "global"
    static = static_peak(outcome.deployment.truss).force
    assert outcome.basins[0].kind == ("fast" if force < 0.999 * static else "inertial")
    # the rope brakes nothing: differences of the replay's angles left 1e-5 of the force there
    assert outcome.deployment.values["least-tension"] >= -2e-7 * force


@pytest.mark.slow
def test_the_tension_of_a_force_driven_motion_is_no_noise() -> None:
    raw = {"minimise": "peak-force", "duration": 3.5, "truss": {"modules": 36}}
    outcome = best_motion(Question(study_from(raw), Console(io.StringIO(), io.StringIO())))
    deployment = outcome.deployment
    assert outcome.verdict.kind == "global"
    # 9e-6 of the force before the law was the integral of its acceleration
    assert deployment.values["least-tension"] >= -2e-7 * deployment.values["peak-force"]
    assert all(criterion.passed for criterion in criteria(study_from(raw), deployment))


@pytest.mark.parametrize("mu", [0.0, 0.01])
@pytest.mark.parametrize("jerk", [69.0, 124.22, 1000.0])
def test_energies_of_the_jerk_limited_laws_balance(mu: float, jerk: float) -> None:
    truss = study_from({"minimise": "energy", "truss": {"pulley_friction": mu}}).truss
    law = JerkLimited(140.0, DEPLOYED - D, DEPLOYED, jerk / 140.0**3)
    assert_energy_balances(Deployment("jerk-limited", law, truss))


def test_energies_of_bezier_balance() -> None:
    for truss in (WITH_FRICTION, study_from({"minimise": "energy"}).truss):
        assert_energy_balances(Deployment("Bezier", PINNED, truss))


@pytest.mark.slow
def test_the_second_objective_of_the_documents_example_is_found() -> None:
    raw = {
        "minimise": ["peak-force", "peak-acceleration"],
        "duration": [4.0, 6.0],
        "concession": 5e-5,
        "caps": {"jerk": 1.6},
        "solver": {"starts": ["bezier"]},
    }
    outcome = best_motion(Question(study_from(raw), Console(io.StringIO(), io.StringIO())))
    values = outcome.deployment.values
    # least force alone: 20.11697 N with 1.119 rad/s^2; capped at 0.916 rad/s^2 it is above what is
    # conceded, so that the least acceleration is between that and what was found, 0.949 rad/s^2
    # either objective is found to 3e-6
    assert values["peak-force"] <= 20.11698 * (1 + 5e-5 + 3e-6)
    assert 0.91 < values["peak-acceleration"] < 0.955
    assert any("is an upper bound" in remark for remark in outcome.remarks)
