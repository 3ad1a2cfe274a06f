"""One number for the accuracy of an answer."""

import math

import numpy as np
import pytest

from ocp import Accuracy, Settings, StatementError


def test_one_number_is_the_accuracy_of_all():
    settings = Settings(accuracy=1e-4)
    assert settings.accuracy == Accuracy(objective=1e-4, dynamics=1e-4, path=1e-4, replay=1e-4)
    assert Settings(accuracy=np.float64(1e-4)) == settings
    assert Settings().accuracy == Accuracy()
    assert eval(repr(settings)) == settings


@pytest.mark.parametrize("value", [0, -1e-3, 0.1, 1, math.nan, math.inf, "1e-4", None, True])
def test_an_accuracy_is_a_positive_number_below_a_tenth(value):
    with pytest.raises(StatementError, match=r"'accuracy' is .*; give a positive number below 0.1"):
        Settings(accuracy=value)


def test_round_off_does_not_allow_any_accuracy():
    with pytest.raises(StatementError, match="'accuracy' is 1e-12; give 1e-09, the least that"):
        Settings(accuracy=1e-12)
    assert Settings(accuracy=1e-9).accuracy.objective == 1e-9
