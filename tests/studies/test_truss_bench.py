"""Studies of a truss on a test bench: what is refused, and that its proofs know of the loads."""

import dataclasses

import pytest

from models.truss import TrussParameters, static_force
from studies.common.exit_codes import StudyError
from studies.mission.config import study_from as mission_from
from studies.truss.config import TrussStudy, as_dictionary, study_from
from studies.truss.limits.bounds import least_work, lower_bounds
from studies.truss.motions.laws import paper_laws
from studies.truss.motions.phase_plane import PhasePlane
from studies.truss.parameters import parameters_of
from studies.turn.config import study_from as turn_from

BENCH = {
    "pulley_friction": 0.01,
    "joint_coulomb": 0.02,
    "slider_coulomb": 0.5,
    "gravity": [-9.81, 0.0, 0.0],
    "off_load": 0.95,
    "off_load_friction": 0.1,
    "other_pulleys": [[9, 2, 0.2]],
    "measured_torque": [[0.07, 5.0], [0.8, 20.0], [1.58, 10.0]],
}


def study(**changes: object) -> TrussStudy:
    raw = {"minimise": "peak-force", "duration": 10.0, "caps": {"jerk": "200/T^3"}}
    return study_from({**raw, "truss": BENCH, **changes})


def test_a_bench_is_stated_and_stated_again() -> None:
    stated = study()
    assert stated.truss.gravity == (-9.81, 0.0, 0.0)
    assert stated.truss.other_pulleys == ((9, 2, 0.2),)
    assert study_from(as_dictionary(stated)) == stated
    # whoever reads the result's first line knows that it is not one of the flight
    assert "with other pulleys, gravity, off load, joint coulomb" in stated.question
    plain = study(truss={"pulley_friction": 0.01})
    assert plain.question == "Ring truss, 24 modules, mu = 0.01, T = 10 s: minimum peak-force"


def test_a_report_lists_the_loads_that_are_stated_and_no_others() -> None:
    lines = {line.name: line.value for line in parameters_of(as_dictionary(study()))}
    assert lines["gravity"] == "-9.81, 0, 0"
    assert lines["other pulleys"] == "9, 2, 0.2"
    plain = {line.name: line.source for line in parameters_of(as_dictionary(study(truss={})))}
    assert not {"gravity", "off load", "measured torque", "joint coulomb"} & set(plain)
    for name in ("elastic modulus", "linear density"):
        assert plain[name] == "assumed; the paper gives none"


def test_energies_of_a_law_balance_with_all_that_a_bench_adds() -> None:
    for law in paper_laws(study().truss, 10.0):
        assert law.energies.imbalance < 1e-8  # as of a smooth law without a bench
        bare = dataclasses.replace(law, truss=TrussParameters(pulley_friction=0.01))
        assert law.values["energy"] > 1.3 * bare.values["energy"]


def test_no_law_of_the_paper_is_better_than_a_bound() -> None:
    stated = study()
    bounds = lower_bounds(stated, None)
    for law in paper_laws(stated.truss, 10.0):
        for key in ("energy", "peak-power", "peak-force"):
            assert law.values[key] >= bounds[key]
    # slow, the work comes near to its bound: only friction of the speed lies between
    slow = study(duration=1e5, caps={})
    law, _ = paper_laws(slow.truss, 1e5)
    assert law.values["energy"] == pytest.approx(least_work(slow, 1e5), rel=1e-3)


def test_the_phase_plane_starts_above_coulomb_friction() -> None:
    truss = study().truss
    plane = PhasePlane(truss)
    breakaway = float(static_force(truss, truss.stowed_angle))
    assert plane.fastest(0.999 * breakaway) is None
    assert plane.limit_force >= breakaway
    motion = plane.fastest(1.5 * plane.limit_force)
    assert motion is not None
    assert motion.speed.min() >= 0.0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"truss": {"off_load": 1.2}}, "truss.off_load is 1.2; give the share"),
        ({"truss": {"gravity": [1.0, 2.0]}}, "truss.gravity is .* give three finite numbers"),
        ({"truss": {"gravity": 9.81}}, "truss.gravity is 9.81; give three finite numbers"),
        ({"truss": {"other_pulleys": [[25, 1, 0.3]]}}, "truss.other_pulleys names module 25"),
        ({"truss": {"other_pulleys": [7, 2, 0.3]}}, "truss.other_pulleys is .*; give rows of"),
        ({"truss": {"measured_torque": [[0.5, 1], [1.6, 2]]}}, "truss.measured_torque covers"),
        ({"truss": {"measured_torque": [[0.5, 1], [0.4, 2]]}}, "measured_torque has the angle 0.4"),
        (
            {
                "truss": {"measured_torque": [[0.07, 1], [1.6, 2]]},
                "margin": {"resistance": [[0.07, 1], [1.6, 2]]},
            },
            "are both given",
        ),
        ({"truss": {"joint_coulomb": 1e9}}, "such a joint is a weld"),
        ({"truss": {"gravity": [1.0, 0.0, 0.0]}, "arm": {}}, "in the plane of ring and arm"),
        (
            {"truss": {"slider_coulomb": 0.5}, "drive": {"rope_stiffness": 600.0}},
            "slider_coulomb is given, but on flexible ropes",
        ),
    ],
)
def test_what_the_models_leave_out_is_refused(changes: dict[str, object], said: str) -> None:
    with pytest.raises(StudyError, match=said):
        study(**changes)


def test_a_mission_and_a_turn_have_no_weight() -> None:
    for one in (mission_from, turn_from):
        with pytest.raises(StudyError, match="the models of the arm include no weight"):
            one({"truss": {"gravity": [1.0, 0.0, 0.0]}})
