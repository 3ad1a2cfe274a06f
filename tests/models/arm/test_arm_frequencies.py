"""Natural frequencies of the arm against exact Euler-Bernoulli values."""

import numpy as np
import pytest

from models.ancf.analysis import natural_modes
from models.ancf.joints import Free, Locked
from models.ancf.state import posed
from models.arm.bulges import tied_to_first_modes
from models.arm.parameters import BIG_ARM, SMALL_ARM, ArmParameters, tube
from models.arm.reduced import ReducedArm
from models.arm.reduced_simulation import reduced_modes
from models.errors import ModelError

STRAIGHT = {  # root, elbow -> f1..f4 [Hz], exact
    ("clamped", "locked"): (0.445349, 12.38216, 40.44667, 83.65282),
    ("pinned", "locked"): (7.824375, 31.66094, 71.92542, 125.62769),
    ("clamped", "free"): (6.733230, 40.43618, 59.97152, 135.36251),
    ("pinned", "free"): (29.84765, 54.73933, 111.29589, 188.64473),
}
HELD = {"clamped": Locked(0.0), "pinned": Free(), "locked": Locked(0.0), "free": Free()}


def bending(case: tuple[str, str], elements: int) -> np.ndarray:
    chain = ArmParameters().chain(elements)
    return natural_modes(chain, [HELD[k] for k in case], posed(chain), count=6).bending[:4]


def test_sections_and_inertias():
    assert BIG_ARM.axial_stiffness == pytest.approx(2.5510e7, rel=1e-4)
    assert BIG_ARM.bending_stiffness == pytest.approx(10739.6, rel=1e-5)
    assert BIG_ARM.linear_density == pytest.approx(0.58308, rel=1e-5)
    assert SMALL_ARM.axial_stiffness == pytest.approx(1.59986e7, rel=1e-5)
    assert SMALL_ARM.bending_stiffness == pytest.approx(4708.58, rel=1e-5)
    assert SMALL_ARM.linear_density == pytest.approx(0.365681, rel=1e-5)
    arm = ArmParameters()
    assert arm.root_inertia() == pytest.approx(767.193, abs=5e-4)
    assert arm.root_inertia(np.pi) == pytest.approx(38.417, abs=5e-4)
    assert arm.elbow_inertia == pytest.approx(120.975, abs=5e-4)


@pytest.mark.parametrize("case", STRAIGHT)
def test_straight_arm_has_the_exact_frequencies(case):
    assert bending(case, 32) == pytest.approx(STRAIGHT[case], rel=1e-5)


@pytest.mark.parametrize("case", STRAIGHT)
def test_highest_frequency_converges_with_order_four(case):
    errors = np.array([bending(case, n)[3] / STRAIGHT[case][3] - 1 for n in (8, 16)])
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.1)


def test_axial_mode_is_told_apart():
    chain = ArmParameters().chain(32)
    modes = natural_modes(chain, [HELD["clamped"], HELD["free"]], posed(chain), count=4)
    assert modes.axial == pytest.approx([58.451], abs=1e-3)
    assert modes.bending == pytest.approx(STRAIGHT["clamped", "free"][:3], rel=1e-5)


@pytest.mark.parametrize(
    ("elbow_deg", "root", "elbow", "wanted"),
    [
        (180, "pinned", "locked", (2.178,)),
        (180, "clamped", "locked", (0.996, 6.733)),
        (180, "clamped", "free", (6.733,)),
        (90, "clamped", "free", (0.985,)),
    ],
)
def test_folded_arm(elbow_deg, root, elbow, wanted):
    chain, angle = ArmParameters().chain(16), np.radians(elbow_deg)
    joints = [HELD[root], Locked(angle) if elbow == "locked" else Free()]
    modes = natural_modes(chain, joints, posed(chain, [0.0, angle]), count=len(wanted))
    assert modes.frequencies == pytest.approx(wanted, abs=6e-4)  # given to three decimals


@pytest.mark.parametrize(("mass", "wanted"), [(10, 0.7608), (20, 0.5435), (50, 0.3459)])
def test_lighter_tip_is_faster(mass, wanted):
    chain = ArmParameters(tip_mass=mass).chain(16)
    modes = natural_modes(chain, [Locked(0.0), Locked(0.0)], posed(chain), count=1)
    assert modes.frequencies[0] == pytest.approx(wanted, abs=6e-5)


@pytest.mark.parametrize(
    ("case", "error"),
    [
        (("clamped", "locked"), 1e-5),
        (("clamped", "free"), 3e-3),
        (("pinned", "locked"), 7e-3),
        (("pinned", "free"), 0.135),  # B21 misses the elbow-free bending of a pinned arm
    ],
)
def test_first_frequency_of_the_reduced_arm(case, error):
    model = reduced(case)
    first = reduced_modes(model, model.at())[0][0]
    assert abs(first / STRAIGHT[case][0] - 1) < error


def reduced(case: tuple[str, str], variant: str = "B21") -> ReducedArm:
    root, elbow = case
    return ReducedArm(
        ArmParameters(),
        variant,
        0.0 if root == "clamped" else None,
        0.0 if elbow == "locked" else None,
    )


def test_reduced_clamped_locked_frequencies():
    model = reduced(("clamped", "locked"))
    assert reduced_modes(model, model.at())[0] == pytest.approx([0.4453, 12.52, 53.3], rel=1e-3)


@pytest.mark.parametrize(
    ("locks", "poses"),
    [
        ((None, np.pi), [(0.0, np.pi)]),
        ((0.0, None), [(0.0, np.pi), (0.0, 0.5 * np.pi), (0.0, 0.0)]),
    ],
)
def test_tied_bulges_make_the_first_frequency_that_of_the_full_model(locks, poses):
    # the reduction's own error beside B32, whose shapes are quartics: 2e-4 in the first mode
    model = tied_to_first_modes(ReducedArm(ArmParameters(), "B21", *locks), poses)
    assert model.size == ReducedArm(ArmParameters(), "B21", *locks).size
    for pose in poses:
        chain = ArmParameters().chain(8)
        joints = [Free() if k is None else Locked(k) for k in locks]
        full = natural_modes(chain, joints, posed(chain, list(pose)), count=1).frequencies[0]
        assert reduced_modes(model, model.at(*pose))[0][0] == pytest.approx(full, rel=2e-4)


def test_quartic_shapes_are_right_to_a_fiftieth_below_60_hz():
    model = reduced(("clamped", "free"), "B32")
    assert reduced_modes(model, model.at())[0][:3] == pytest.approx(
        STRAIGHT[("clamped", "free")][:3], rel=2e-2
    )


def test_freeing_the_tip_slope_gains_little():
    model = reduced(("pinned", "free"), "B22")
    first = reduced_modes(model, model.at())[0][0]
    assert first / 29.84765 - 1 == pytest.approx(0.12, abs=5e-3)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: ArmParameters(tip_mass=-1), "tip mass is -1"),
        (lambda: ArmParameters(damping_ratio=-0.01), "damping ratio is -0.01"),
        (lambda: tube(1.0, 0.05, 0.0), "wall is 0"),
        (lambda: ReducedArm(ArmParameters(), "B23"), "variant is 'B23'; use"),
    ],
)
def test_bad_input_names_thing_value_and_remedy(build, words):
    with pytest.raises(ModelError, match=words):
        build()
