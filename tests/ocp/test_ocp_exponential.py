"""The exponential of small matrices against SciPy's."""

import numpy as np
import pytest
from scipy.linalg import expm

from ocp.verification.error_growth import exponential


@pytest.mark.parametrize("size", [0.0, 1e-8, 0.3, 5.0, 40.0])
def test_the_exponential_is_that_of_scipy(size: float) -> None:
    matrices = size * np.random.default_rng(1).normal(size=(5, 4, 4)) / 4
    wanted = expm(matrices)
    error = np.abs(exponential(matrices) - wanted).max(axis=(1, 2))
    # both square back; a growth by 1e10 costs a few digits, a factor of interest 1e6
    assert (error <= 1e-11 * np.abs(wanted).max(axis=(1, 2))).all()


def test_what_overflows_is_not_finite_and_warns_nobody() -> None:
    found = exponential(np.array([[[1e6, 0.0], [0.0, 0.0]]]))
    assert not np.isfinite(found).all()
