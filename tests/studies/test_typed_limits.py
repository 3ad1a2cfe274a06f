"""Limits that messages print can be typed back."""

import re

import pytest

from studies.common.console import silent
from studies.common.exit_codes import StudyError
from studies.common.typed_limits import lower_limit, upper_limit
from studies.truss.config import study_from
from studies.truss.search.motion_search import Search


@pytest.mark.parametrize("value", [0.003696149, 85.09190001, 60.0, 1.2345678e-7, 123456789.0])
def test_a_printed_limit_is_on_the_side_that_works(value: float) -> None:
    assert 0.0 <= float(upper_limit(value)) - value <= 1e-5 * value
    assert 0.0 <= value - float(lower_limit(value)) <= 1e-5 * value
    assert float(upper_limit(60.0)) == float(lower_limit(60.0)) == 60.0


def test_the_least_tension_that_is_named_is_not_refused_again() -> None:
    truss = {"bar_length": 2.4, "half_cross_bar": 1.15, "modules": 18, "link": 0.2}
    raw = {
        "minimise": "peak-force",
        "duration": 60.0,
        "caps": {"jerk": 1e-3, "least_tension": 1.0},
        "truss": {**truss, "pulley_friction": 0.02, "spring_stiffness": 300.0},
    }
    with pytest.raises(StudyError) as refused:
        Search(study_from(raw), silent()).check()
    found = re.search(r"to (\S+) N; lower", str(refused.value))
    assert found is not None
    raw["caps"]["least_tension"] = float(found[1])  # type: ignore[index]
    Search(study_from(raw), silent()).check()
