"""Cases of flexible links: how they are read, and what they are built into."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

import studies.flex
from models.ancf.joints import joint_rates
from models.arm.parameters import ArmParameters, double_pendulum, single_pendulum
from studies.cli import main
from studies.common.configuration import toml_text
from studies.common.exit_codes import ExitCode, StudyError
from studies.flex import study_from
from studies.flex.build import build, moving, rigid_inertia, variants
from studies.flex.config import as_dictionary
from studies.flex.drives import joint_law, with_tables

ROOT = Path(studies.flex.__path__[0])
CASES = sorted([*(ROOT / "presets").glob("*.toml"), *(ROOT / "examples").glob("*.toml")])

LINK = {"length": 1.0, "area": 1e-4, "second_moment": 1e-9, "modulus": 7e10, "density": 2700.0}


def case(**changes):
    """A valid case of one free link, with changes."""
    return {"duration": 1.0, "link": [LINK], "joint": [{}], **changes}


def preset(name):
    """A case of the paper."""
    return study_from(tomllib.loads((ROOT / "presets" / f"{name}.toml").read_text("utf-8")))


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_a_committed_case_is_read_built_and_stated_again(path):
    study = study_from(tomllib.loads(path.read_text("utf-8")))
    assert study.question
    build(study)
    again = study_from(tomllib.loads(toml_text(as_dictionary(study))))
    assert again == study


def test_the_presets_are_the_papers():
    assert build(preset("single-pendulum")).chain == single_pendulum(8)
    assert build(preset("double-pendulum")).chain == double_pendulum(8)
    damped = ArmParameters(damping_ratio=0.005, damping_frequency=5.0)
    for name, arm, joint, torque in (
        ("big-arm", ArmParameters(), 0, 0.04896),
        ("small-arm", damped, 1, -0.18179),
    ):
        flex = build(preset(name))
        assert flex.chain == arm.chain(4)
        # 6 J dtheta / T^2, to the four digits of an independent code
        assert flex.joints[joint].torque(np.zeros(1))[0] == pytest.approx(torque, rel=2e-4)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"link": [{**LINK, "length": 0}]}, "link[0].length is 0; give a finite positive number"),
        ({"link": [LINK, {**LINK, "density": -1.0}]}, "link[1].density is -1.0"),
        ({"link": []}, "there is no link"),
        ({"link": [{**LINK, "length": 0.0}]}, "link[0].length is 0.0; give a finite positive"),
        ({"link": [{"area": 1.0}]}, "link[0] has no length; give one in m"),
        ({"link": [{**LINK, "lenght": 1}]}, "unknown key link[0].lenght; did you mean"),
        ({"joint": [{}, {}]}, "joint[1] has no link"),
        ({"link": [LINK, LINK]}, "link[1] has no joint"),
        ({"link": [{**LINK, "diameter": 0.1}]}, "its section by diameter and area"),
        (
            {"link": [{"length": 1.0, "area": 1e-4, "modulus": 1e9, "density": 1e3}]},
            "link[0] has only one of area and second_moment; give both",
        ),
        (
            {
                "link": [
                    {"length": 1.0, "diameter": 0.1, "wall": 0.06, "modulus": 1e9, "density": 1}
                ]
            },
            "link[0].wall is 0.06 m, more than half",
        ),
        ({"link": [{"length": 1.0, "diameter": 0.1}]}, "link[0] has no material"),
        (
            {"link": [{"length": 1.0, "diameter": 0.1, "material": "wood"}]},
            "link[0].material is 'wood', but the known materials are none",
        ),
        ({"joint": [{"kind": "driven"}]}, "joint[0].kind is 'driven'"),
        ({"joint": [{"kind": "torque"}]}, "its law is given by nothing"),
        ({"joint": [{"expression": "t"}]}, "joint[0] is free, but has expression"),
        (
            {"joint": [{"kind": "angle", "law": "quintic"}]},
            "its turn is zero or missing; give turn_deg",
        ),
        (
            {"joint": [{"kind": "angle", "law": "linear", "turn_deg": 1.0}]},
            "the law linear applies only to a torque",
        ),
        (
            {"joint": [{"kind": "torque", "expression": "sqrt(t - 0.5)"}]},
            "joint[0]: its expression 'sqrt(t - 0.5)' gives nan at t = 0 s",
        ),
        (
            {"joint": [{"kind": "angle", "expression": "sqrt(t)"}]},
            "gives inf as its rate at t = 0 s",
        ),
        (
            {"joint": [{"kind": "angle", "expression": "1 + t", "start_deg": 0.0}]},
            "start_deg is 0, but its law starts at 57.2958 deg",
        ),
        (
            {"joint": [{"kind": "torque", "times": [0, 1, 2], "values": [0, 1, 2]}]},
            "has 3 times and 3 values; give equally many, at least 4",
        ),
        (
            {"joint": [{"kind": "torque", "times": [0, 0.1, 0.2, 0.3], "values": [0, 1, 2, 3]}]},
            "its table ends at 0.3 s, before 1 s",
        ),
        ({"link": [{**LINK, "length": 1e300}]}, "link[0].length is 1e+300; give a number from"),
        ({"link": [{**LINK, "end_mass": 1e308}]}, "link[0].end_mass is 1e+308; give a number"),
        ({"duration": 10**400}, "give a finite positive number"),
        ({"joint": [{"latch_deg": 0.0}]}, "joint[0] starts at its latch, 0 deg"),
        ({"joint": [{"lock_time": 2.0}]}, "joint[0].lock_time is 2 s, after the motion's 1 s"),
        ({"gravity": [0.0]}, "gravity is [0.0]; give a list of 2 or more numbers"),
        ({"duration": 0}, "duration is 0"),
        ({"sweep": {"speed": [0.0]}}, "sweep.speed is 0.0"),
        ({"form": "index1"}, "form is 'index1'; did you mean index-1?"),
    ],
)
def test_a_wrong_case_is_answered_in_a_sentence(changes, words):
    with pytest.raises(StudyError) as refused:
        build(study_from(case(**changes)))
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((), "no study is given; name one STUDY.toml, or --preset"),
        (("--preset", "big_arm"), "there is no preset 'big_arm'; did you mean big-arm?"),
        (("missing.toml",), "missing.toml cannot be read"),
        (("a.toml", "--preset", "big-arm"), "both a.toml and --preset big-arm are given"),
        (("--preset", "single-pendulum", "--duration", "0"), "duration is 0"),
        (("--preset", "single-pendulum", "--form", "dae"), "form is 'dae'"),
    ],
)
def test_a_wrong_command_is_answered_in_a_sentence(words, sentence, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["flex", *words]) == ExitCode.BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert sentence in line
    assert not (tmp_path / "results").exists()


def test_a_csv_beside_the_case_becomes_part_of_it(tmp_path):
    times = np.linspace(0.0, 1.0, 21)
    rows = [f"{t},{math.degrees(t**3)}" for t in times]
    (tmp_path / "law.csv").write_text("\n".join(["# a turn", "time [s], angle_deg [deg]", *rows]))
    stated = study_from(case(joint=[{"kind": "angle", "csv": "law.csv"}]))
    study = with_tables(stated, tmp_path)
    assert study.joint[0].csv is None
    angle, rate, _ = joint_law(study, 0).history(np.array([0.55]))
    # a quintic spline holds a cubic exactly
    assert [angle[0], rate[0]] == pytest.approx([0.55**3, 3 * 0.55**2], rel=1e-9)

    (tmp_path / "law.csv").write_text("time, torque\n0, 1\n")
    with pytest.raises(StudyError, match="has the columns time, torque; give time and angle"):
        with_tables(stated, tmp_path)


def test_a_moving_start_keeps_its_joints():
    flex = build(preset("double-pendulum"))
    state = moving(flex.chain, np.array([0.3, -0.5]), np.array([0.7, 0.2]))
    rates = joint_rates(flex.chain, state.q[:, None], state.v[:, None])[:, 0]
    assert rates == pytest.approx([0.7, 0.2], rel=1e-12)


def test_the_rigid_inertia_is_that_of_the_closed_form():
    chain = ArmParameters().chain(4)
    for angles, joint, inertia in (
        ((0.0, 0.0), 0, 767.193),
        ((0.0, math.pi), 0, 38.417),
        ((0.0, math.pi), 1, 120.975),
    ):
        assert rigid_inertia(chain, np.array(angles), joint) == pytest.approx(inertia, rel=1e-5)


def test_a_sweep_changes_one_thing_at_a_time():
    study = preset("big-arm")
    found = {(quantity, factor): changed for quantity, factor, changed in variants(study)}
    assert len(found) == 6  # the multiple 1 is the case itself
    faster = build(found["speed", 4.0])
    assert faster.study.time == pytest.approx(24.0)
    plain = build(study)
    t = np.array([3.0])
    ratio = faster.joints[0].torque(t)[0] / plain.joints[0].torque(4 * t)[0]
    assert ratio == pytest.approx(16.0)
    stiff = build(found["modulus", 2.0]).chain.links[0]
    assert stiff.bending_stiffness == pytest.approx(2 * plain.chain.links[0].bending_stiffness)
    assert build(found["length", 1.25]).chain.links[1].length == pytest.approx(2.5)
