"""Laws as text: what they may say, and that nothing of them is run as Python."""

import numpy as np
import pytest

from studies.common.exit_codes import StudyError
from studies.flex.expressions import DEEPEST, LONGEST, read_law


@pytest.mark.parametrize(
    ("text", "value", "rate", "acceleration"),
    [
        ("3", 3.0, 0.0, 0.0),
        ("t**3/6", 0.125 / 6, 0.125, 0.5),
        ("-sin(2*t) + 1", 1 - np.sin(1.0), -2 * np.cos(1.0), 4 * np.sin(1.0)),
        ("exp(t)*pi/T", np.exp(0.5) * np.pi / 4, np.exp(0.5) * np.pi / 4, np.exp(0.5) * np.pi / 4),
        ("smooth(t)", 0.5, 1.875, 0.0),
        ("step(t - 0.4) + min(t, 0.3) + max(t, 2)", 1 + 0.3 + 2, 0.0, 0.0),
    ],
)
def test_a_law_has_its_value_and_exact_derivatives(text, value, rate, acceleration):
    found = read_law("joint[0].expression", text, 4.0).at(np.array([0.5]))
    assert [float(part[0]) for part in found] == pytest.approx(
        [value, rate, acceleration], abs=1e-14
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "__import__('os').system('x')",
            "calls '__import__('os').system', which is not allowed in a law",
        ),
        ("().__class__", "a dot, which is not allowed in a law"),
        ("t.real", "a dot, which is not allowed in a law"),
        ("open('f')", "calls 'open', which is not allowed in a law; the known functions are sin"),
        ("sinn(t)", "calls 'sinn', which is not allowed in a law; did you mean sin?"),
        ("[t][0]", "an index, which is not allowed in a law"),
        ("lambda: t", "lambda, which is not allowed in a law"),
        ("t if t > 1 else 0", "'t if t > 1 else 0', which is not allowed in a law"),
        ("t and 1", "which is not allowed in a law"),
        ("(x := 3)", "which is not allowed in a law"),
        ("'a'", "has 'a', which is not a number"),
        ("True", "has True, which is not a number"),
        ("2j", "has 2j, which is not a number"),
        ("x + 1", "has the unknown name 'x'"),
        ("time", "has the unknown name 'time'; the known names are t"),
        ("sin(t, 1)", "sin takes 1 argument(s)"),
        ("sin(x=1)", "sin takes 1 argument(s)"),
        ("t +", "which is not an expression in t"),
        ("t; t", "which is not an expression in t"),
        ("", "give an expression in t"),
        ("9" * 400, "a number beyond 1e308"),
        ("+" * 400 + "t", f"more than {DEEPEST} nested levels"),
        ("(" * 300 + "t" + ")" * 300, "which is not an expression in t"),
        ("t+" * LONGEST + "t", f"give at most {LONGEST}"),
    ],
)
def test_anything_else_is_refused_in_a_sentence(text, words):
    with pytest.raises(StudyError) as refused:
        read_law("joint[0].expression", text, 4.0)
    assert words in str(refused.value)
    assert str(refused.value).startswith("joint[0].expression")


def test_a_tower_of_powers_fills_no_memory():
    value, _, _ = read_law("law", "9**9**9", 1.0).at(np.zeros(1))
    assert not np.isfinite(value[0])
