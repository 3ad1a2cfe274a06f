"""Limits that a message prints can be typed back."""

from hypothesis import given
from hypothesis import strategies as st

from studies.common.rounding import down, up


@given(st.floats(1e-12, 1e12))
def test_a_printed_limit_is_on_the_side_that_works(value: float) -> None:
    assert float(down(value)) <= value <= float(up(value))
    assert float(up(value)) - float(down(value)) <= 1.1e-5 * value


def test_a_number_of_few_digits_is_printed_as_it_is() -> None:
    assert (up(0.25), down(0.25), up(85.0)) == ("0.25", "0.25", "85")
    # a least tension that statics fix to 0.003696149 N
    assert down(0.003696149) == "0.00369614"
