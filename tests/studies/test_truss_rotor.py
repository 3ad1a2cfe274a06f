"""The rotor of a motor: its force by hand, figures derived elsewhere, the phase plane."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from models.truss import DYNAMIC_SET, rope_acceleration, rope_force, static_peak
from studies.common.console import silent
from studies.common.exit_codes import StudyError
from studies.drive.schema import Drive
from studies.truss.config import TrussStudy, as_dictionary, study_from
from studies.truss.limits.bounds import lower_bounds
from studies.truss.limits.caps import Caps
from studies.truss.limits.feasibility import check_feasible
from studies.truss.motions.laws import paper_laws
from studies.truss.motions.phase_plane import PhasePlane
from studies.truss.study import run
from tests.studies.plain_collocation import least_peak

ROPES = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01)
ROTOR = Drive(drum_radius=0.02, gear_ratio=50.0, motor_inertia=2e-6)
MASS = 2e-6 * (50.0 / 0.02) ** 2  # [kg] on the rope
T = 10.0


def stated(minimise="peak-motor-force", duration=T, drive=ROTOR, jerk="200/T^3", **caps):
    caps = Caps(jerk=jerk, **caps)
    return TrussStudy(minimise=minimise, duration=duration, drive=drive, truss=ROPES, caps=caps)


def test_no_inertia_is_as_without_the_key() -> None:
    plain = Drive(drum_radius=0.02, gear_ratio=50.0, torque_speed=[[0, 0.05], [4000, 0]])
    (law, _), (same, _) = (
        paper_laws(ROPES, T, drive)
        for drive in (plain, dataclasses.replace(plain, motor_inertia=0.0))
    )
    assert law.values == same.values
    assert "peak-motor-force" not in law.values


@pytest.mark.parametrize(
    ("law", "motor", "rope", "duration"),
    # derived elsewhere, to the digits shown
    [(0, 45.3, 44.3, 10.0), (1, 48.5, 46.9, 10.0)],
)
def test_peaks_of_the_papers_laws(law: int, motor: float, rope: float, duration: float) -> None:
    values = paper_laws(ROPES, duration, ROTOR)[law].values
    assert values["peak-motor-force"] == pytest.approx(motor, abs=0.05)
    assert values["peak-force"] == pytest.approx(rope, abs=0.05)
    assert values["peak-motor-torque"] == pytest.approx(
        values["peak-motor-force"] * 0.02 / 50.0, rel=1e-12
    )


def test_a_slow_motion_hardly_feels_its_rotor() -> None:
    values = paper_laws(ROPES, 140.0, ROTOR)[0].values
    gained = values["peak-motor-force"] - values["peak-force"]
    assert abs(gained) == pytest.approx(0.03, abs=0.005)


@pytest.mark.parametrize("layers", [{}, {"rope_diameter": 0.004, "layer_turns": 3.0}])
def test_torque_and_power_are_those_of_the_turning_rotor(layers: dict[str, float]) -> None:
    drive = dataclasses.replace(ROTOR, efficiency=0.7, **layers)
    law = paper_laws(ROPES, T, drive)[1]
    step = 1e-3
    time = np.linspace(0.5, 9.5, 181)
    turns = [drive.drum.turn_at(law.motor(law.at(time + k * step)[1]).wound) for k in (-1, 0, 1)]
    _, truss = law.at(time)
    motor = law.motor(truss)
    rate = (turns[2] - turns[0]) / (2 * step) * drive.gear_ratio
    bend = (turns[2] - 2 * turns[1] + turns[0]) / step**2 * drive.gear_ratio

    radius = drive.drum.radius_at(motor.wound)
    by_hand = truss.rope_force * radius / (50.0 * 0.7) + 2e-6 * bend
    speed, torque = motor.shaft_speed, motor.torque
    # differences are off by step^2, and where a climb of a layer ends the acceleration jumps
    ends = np.array(drive.drum.corners(7.0))
    away = np.abs(motor.wound[:, None] - ends).min(axis=1, initial=1.0) > 0.01
    assert speed == pytest.approx(rate, rel=1e-4)
    assert torque[away] == pytest.approx(by_hand[away], rel=2e-4)
    assert motor.power == pytest.approx(2 * 0.7 * torque * speed, rel=1e-9)
    # from rest to rest a rotor takes no work
    assert law.motor_energy()[-1] == pytest.approx(law.values["energy"], rel=1e-9)


def test_a_rotor_needs_a_drum_and_its_force_a_rotor() -> None:
    with pytest.raises(StudyError, match="motor_inertia is given without a drum"):
        Drive(motor_inertia=2e-6)
    with pytest.raises(StudyError, match="peak-motor-force needs the drive; add motor_inertia"):
        stated(drive=Drive(drum_radius=0.02))
    assert study_from(as_dictionary(stated())) == stated()


def test_bounds_are_those_of_work_and_rest_and_not_of_the_ridge() -> None:
    bounds = lower_bounds(stated(), None)
    assert bounds["peak-motor-force"] == pytest.approx(17.94, abs=5e-3)  # at rest when deployed
    bounds = lower_bounds(stated(jerk=None), None)
    assert bounds["peak-motor-force"] == pytest.approx(17.7, abs=0.05)  # work over travel
    assert bounds["peak-motor-torque"] == pytest.approx(bounds["peak-motor-force"] * 0.02 / 50.0)
    assert bounds["peak-motor-force"] < static_peak(ROPES).force


@pytest.mark.parametrize("caps", [{"motor_force": 17.0}, {"motor_torque": 17.0 * 0.02 / 50.0}])
def test_less_than_any_motor_needs_is_refused_with_the_number(caps: dict[str, float]) -> None:
    with pytest.raises(StudyError, match=r"every motion needs at least 17\.940\d* N"):
        check_feasible(stated(**caps), PhasePlane(ROPES).least_force)


@pytest.mark.slow
@pytest.mark.parametrize("duration", [3.0, 5.0])
def test_without_other_caps_the_phase_plane_is_met(duration: float) -> None:
    """Its motion pulls with F and brakes with F: least force in a time, and least time."""
    force = PhasePlane(ROPES, MASS).least_force(duration).force
    result = run(stated(duration=duration, jerk=None), silent())
    assert result.value("peak-motor-force") == pytest.approx(force, rel=1e-4)
    assert result.verdict.kind == "global"
    study = stated("time", duration=[1.0, 2 * duration], jerk=None, motor_force=force)
    assert run(study, silent()).value("time") == pytest.approx(duration, rel=1e-4)


@pytest.mark.slow
def test_the_least_force_of_a_motor_with_its_rotor() -> None:
    result = run(stated(), silent())
    assert result.passed
    assert result.value("peak-motor-force") == pytest.approx(23.22, abs=5e-3)
    assert result.value("peak-force") == pytest.approx(40.8, abs=0.05)
    (said,) = (remark for remark in result.remarks if "To restart from" in remark)
    assert "at most 23.22 N, its rotor included" in said
    assert "at 84.34 deg it needs 39.64 N, 0.01586 N m" in said

    def motor(*motion):
        force = rope_force(ROPES, *motion) - MASS * rope_acceleration(ROPES, *motion)
        return [force, -force]

    def slack(*motion):
        return [-rope_force(ROPES, *motion)]

    plain = least_peak(ROPES, T, 200 / T**3, motor, slack, intervals=110, points=16)
    assert result.value("peak-motor-force") == pytest.approx(plain, rel=1e-4)


@pytest.mark.slow
def test_a_rope_force_close_to_its_least_costs_the_motor_much() -> None:
    """Laws of nearly the least rope force, 39.68 N, need 43.7 N at the motor, or more."""
    found = run(stated(force=39.692), silent()).value("peak-motor-force")
    assert found == pytest.approx(43.7, abs=0.3)
