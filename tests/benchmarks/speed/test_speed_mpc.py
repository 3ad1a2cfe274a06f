"""The cart-pole of the part "mpc": both controllers drive it alike, and the motion is pinned."""

import numpy as np
import pytest

from benchmarks.speed import mpc
from studies.common.exit_codes import StudyError

PINNED = (-0.69073285, 1.40538906, -3.01075487, -3.48280400)  # [m, rad, m/s, rad/s]


def test_a_prepared_problem_controls_as_a_program_by_hand():
    loops = mpc.closed_loops(4)
    assert loops.apart < 1e-7
    assert loops.states["prepared"][-1] == pytest.approx(PINNED, abs=1e-6)


def test_motions_that_differ_are_no_measurement(monkeypatch):
    monkeypatch.setattr(mpc, "CONTROLLERS", {"one": lambda: np.sum, "other": lambda: np.ptp})
    with pytest.raises(StudyError, match="differ"):
        mpc.closed_loops(2)
