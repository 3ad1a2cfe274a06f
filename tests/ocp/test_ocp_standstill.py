"""A refinement ends where it stands still, and its best mesh is the answer."""

from types import SimpleNamespace

import numpy as np
import pytest

from ocp import Accuracy
from ocp.refinement.endings import stands_still
from ocp.refinement.solved_mesh import SolvedMesh, best_of, is_refuted
from ocp.scaling.scales import Scales

ACCURACY = Accuracy()


def mesh_round(
    objective,
    *,
    excess=0.0,
    dynamics=1e-9,
    gain=0.0,
    tight=True,
    finer=True,
    off_kinks=0.0,
    beyond=0.0,
):
    """A solved mesh as far as the end of a refinement looks at it."""
    problem = SimpleNamespace(sense=1.0)
    scales = Scales({}, {}, {}, {}, time=1.0, objective=1.0)
    iterate = SimpleNamespace(
        objective=objective, scales=scales, problem=problem, objective_size=abs(objective)
    )
    errors = SimpleNamespace(
        excess=excess,
        dynamics=dynamics,
        gain=gain,
        farthest_crossing=off_kinks,
        beyond_kinks=beyond,
    )
    return SolvedMesh(iterate, errors, 0.0, tight, finer)


def test_a_refinement_stands_still_where_only_last_digits_are_missing():
    still = [mesh_round(2.0 + 1e-7 * i, excess=5e-7) for i in range(3)]
    assert stands_still(still[:2], ACCURACY)
    assert not stands_still(still[:1], ACCURACY)


def test_a_refinement_goes_on_once_more_where_that_only_closes_leaks():
    closing = [mesh_round(2.0, excess=e, finer=False) for e in (9e-7, 7e-7, 5e-7)]
    assert not stands_still(closing[:2], ACCURACY, removes_violations=True)
    assert stands_still(closing, ACCURACY, removes_violations=True)


def test_a_refinement_goes_on_while_breakpoints_come_nearer_to_kinks():
    def nearing(*off):
        return [mesh_round(2.0, excess=5e-7, off_kinks=each) for each in off]

    assert not stands_still(nearing(1e-4, 1e-6), ACCURACY)
    assert stands_still(nearing(1e-6, 1e-6), ACCURACY)
    assert stands_still(nearing(1e-6, 1e-9), ACCURACY)


def promising(*gains, finer=True, excess=5e-7):
    return [mesh_round(2.0, gain=gain, finer=finer, excess=excess) for gain in gains]


def test_a_promised_gain_is_refuted_by_a_finer_mesh_that_promises_as_much():
    assert stands_still(promising(2.7e-6, 2.0e-6), ACCURACY)
    assert not stands_still(promising(2.7e-6, 2.0e-6, finer=False), ACCURACY)
    assert not stands_still(promising(4e-5, 2.7e-6), ACCURACY)
    # what promises less than the tolerance needs no finer mesh
    assert stands_still(promising(2.7e-6, 2.0e-7, finer=False), ACCURACY)


@pytest.mark.parametrize(
    ("gain", "excess"), [(2e-5, 5e-7), (2e-6, 0.0)], ids=["much", "all that is open"]
)
def test_two_finer_meshes_refute_a_promised_gain_that_is_much_or_all_that_is_open(gain, excess):
    assert not stands_still(promising(gain, gain, excess=excess), ACCURACY)
    assert stands_still(promising(gain, gain, gain, excess=excess), ACCURACY)


def falling(*gained):
    """Meshes whose promise falls by 1e-5, then by 5e-6, and whose objective gains so much."""
    objectives = 2.0 * (1.0 - np.cumsum([0.0, *gained]))
    promises = (2e-5, 1e-5, 5e-6)
    return [mesh_round(o, gain=g) for o, g in zip(objectives, promises, strict=True)]


def test_a_promise_is_refuted_where_it_falls_by_far_more_than_is_gained():
    assert stands_still(falling(2e-7, 1e-7), ACCURACY)
    # a third of what it fell by: so much of the rest is more than is left alone
    assert not is_refuted(falling(4e-6, 1e-6), 2, ACCURACY)
    # one mesh may have been finer at the wrong place
    assert not is_refuted(falling(2e-7, 1e-7)[1:], 1, ACCURACY)
    # and much is no last digit
    assert not is_refuted(promising(1e-3, 3e-4, 1e-4), 2, ACCURACY)


def test_a_refinement_goes_on_while_what_leaks_falls_fast():
    assert not stands_still([mesh_round(2.0, excess=e) for e in (7e-5, 5e-6, 9e-7)], ACCURACY)
    assert stands_still([mesh_round(2.0, excess=e) for e in (7e-5, 9e-7, 9e-7)], ACCURACY)
    assert stands_still([mesh_round(2.0, excess=e) for e in (7e-7, 5e-7, 3e-7)], ACCURACY)


def test_a_limit_that_has_just_begun_to_leak_gets_a_mesh_to_be_closed_on():
    begun, stays = (
        [mesh_round(2.0, excess=e, finer=False) for e in leaks]
        for leaks in ((5e-7, 5e-7, 2e-4), (5e-7, 2e-4, 2e-4))
    )
    assert not stands_still(begun, ACCURACY)
    assert not stands_still(begun, ACCURACY, removes_violations=True)
    assert stands_still(stays, ACCURACY, removes_violations=True)


@pytest.mark.parametrize(
    "last",
    [
        mesh_round(2.0001, excess=5e-7),
        mesh_round(2.0, excess=5e-7, tight=False),
    ],
    ids=["the objective moves", "rough"],
)
def test_a_refinement_goes_on(last):
    assert not stands_still([mesh_round(2.0, excess=5e-7)] * 2 + [last], ACCURACY)


@pytest.mark.parametrize(
    "errors",
    [
        {"excess": 2e-6},
        {"dynamics": 2e-7},
        {"gain": 1e-5, "finer": False},
    ],
    ids=["leaks", "dynamics", "a gain that no finer mesh has refuted"],
)
def test_a_refinement_goes_on_where_more_is_missing(errors):
    assert not stands_still([mesh_round(2.0, **errors)] * 3, ACCURACY)


def test_the_best_round_is_the_answer_and_not_the_last():
    nearly, worse = mesh_round(2.0, excess=5e-7), mesh_round(1.9, excess=1e-3)
    assert best_of([worse, nearly, worse], ACCURACY) is nearly
    holds = mesh_round(2.0 + 1e-7)
    assert best_of([nearly, holds, worse], ACCURACY) is holds
    # a first mesh may keep all constraints at points that are too few for a good motion
    coarse, leaks_less = mesh_round(2.1), mesh_round(2.0 + 1e-7, excess=2e-7)
    assert best_of([coarse, nearly, worse], ACCURACY) is nearly
    assert best_of([coarse, nearly, leaks_less], ACCURACY) is leaks_less


def test_a_round_that_meets_all_tolerances_is_not_given_up_for_what_a_leak_gains():
    leaks, meets = mesh_round(2.0, excess=5e-7, gain=4e-4), mesh_round(2.0 + 5e-6)
    assert best_of([leaks, meets], ACCURACY) is meets
    # nobody knows which of two is right that differ by more, or which of them ends too early
    assert best_of([leaks, mesh_round(2.0 + 5e-5)], ACCURACY) is leaks
    assert best_of([leaks, mesh_round(2.0 + 5e-6, gain=2e-6)], ACCURACY) is leaks
    assert best_of([mesh_round(2.0), meets], ACCURACY).iterate.objective == 2.0


def test_a_round_that_a_certificate_passes_is_the_better_of_equal_ones():
    promising = mesh_round(2.0, gain=3e-5)
    certified = mesh_round(2.0 + 1e-7, excess=5e-7, gain=5e-6)
    assert best_of([promising, certified], ACCURACY) is certified
    assert best_of([certified, promising], ACCURACY) is certified
    # within what it allows the tolerances decide
    holds = mesh_round(2.0 + 1e-7, gain=6e-6)
    assert best_of([holds, certified], ACCURACY) is holds
    # and where none passes, too
    worse = mesh_round(2.0 + 1e-7, excess=5e-7, gain=2e-5)
    assert best_of([worse, promising], ACCURACY) is promising


def test_a_round_whose_breakpoints_are_on_its_kinks_is_the_better_of_equal_ones():
    beside, at = mesh_round(2.0 - 1e-7, off_kinks=1e-5), mesh_round(2.0, off_kinks=1e-9)
    assert best_of([beside, at], ACCURACY) is at
    assert best_of([beside, mesh_round(2.0, excess=5e-7)], ACCURACY) is beside


def test_a_round_that_gains_beyond_a_kink_is_no_answer():
    gains, at = mesh_round(1.9, off_kinks=1e-3, beyond=1e-3), mesh_round(2.0, off_kinks=1e-9)
    assert best_of([gains, at], ACCURACY) is at
    # unless there is no other one
    assert best_of([gains], ACCURACY) is gains
