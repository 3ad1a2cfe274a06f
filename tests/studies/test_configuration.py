"""Configurations: what is read, what is refused, and that a study survives its own TOML."""

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from studies.common.configuration import (
    boolean,
    check,
    choice,
    choices,
    finite,
    from_mapping,
    key,
    key_of,
    nearest,
    not_negative,
    optional,
    positive,
    put,
    read_toml,
    section,
    toml_text,
    whole,
)
from studies.common.exit_codes import SHOWN, StudyError, quoted
from studies.common.keys import key_lines
from studies.truss.config import study_from


@dataclass(frozen=True, kw_only=True)
class Inner:
    """A section."""

    cap: float | None = key(optional(positive), "N", "maximum force", default=None)

    def __post_init__(self) -> None:
        check(self, "inner.")


@dataclass(frozen=True, kw_only=True)
class Outer:
    """A configuration."""

    name: str = key(choice(("slow", "fast")), "", "how", default="slow")
    count: int = key(whole(2, 9), "", "how many", default=3)
    inner: Inner = key(section(Inner), "", "limits", factory=Inner)

    def __post_init__(self) -> None:
        check(self)


@pytest.mark.parametrize(
    ("read", "value", "meant"),
    [
        (positive, 2, 2.0),
        (not_negative, 0, 0.0),
        (finite, -1, -1.0),
        (boolean, True, True),
        (whole(2), 2, 2),
        (choice(("a", "b")), "b", "b"),
        (choices(("a", "b")), ["b", "a"], ("b", "a")),
        (optional(positive), "none", None),
        (optional(positive), None, None),
    ],
)
def test_what_is_meant_is_read(read: Any, value: object, meant: object) -> None:
    assert read("x", value) == meant


@pytest.mark.parametrize(
    ("read", "value", "sentence"),
    [
        (positive, 0, "x is 0; give a finite positive number"),
        (positive, True, "x is True; give a finite positive number"),
        (positive, "1", "x is '1'; give a finite positive number"),
        (not_negative, math.nan, "x is nan; give a finite non-negative number"),
        (finite, math.inf, "x is inf; give a finite number"),
        (boolean, 1, "x is 1; give true or false"),
        (whole(2), 2.0, "x is 2.0; give a whole number of at least 2"),
        (whole(2, 9), 10, "x is 10; give a whole number of at most 9"),
        (choice(("slow", "fast")), "slwo", "x is 'slwo'; did you mean slow?"),
        (choice(("slow", "fast")), 7, "x is 7; choose one of slow, fast"),
        (choices(("a", "b")), "a", "x is 'a'; give a list out of a, b"),
        (choices(("a", "b")), [], "x is []; give a list out of a, b"),
        (section(Inner), 3, "x is 3; make it a table: [x]"),
    ],
)
def test_what_is_wrong_is_one_sentence(read: Any, value: object, sentence: str) -> None:
    with pytest.raises(StudyError) as caught:
        read("x", value)
    assert str(caught.value) == sentence


def test_sections_are_read_and_their_keys_named_in_full() -> None:
    outer = from_mapping(Outer, {"count": 4, "inner": {"cap": 3}})
    assert outer == Outer(count=4, inner=Inner(cap=3.0))
    with pytest.raises(StudyError, match=r"unknown key inner\.cpa; did you mean inner\.cap\?"):
        from_mapping(Outer, {"inner": {"cpa": 3}})
    with pytest.raises(StudyError, match=r"inner\.cap is -1; give a finite positive number"):
        from_mapping(Outer, {"inner": {"cap": -1}})
    with pytest.raises(StudyError, match="unknown key nothing; known are name, count, inner"):
        from_mapping(Outer, {"nothing": 1})


def test_a_key_that_another_study_has_too_is_said_alike() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Other:
        cap: float | None = key_of(Inner, "cap")

        def __post_init__(self) -> None:
            check(self, "other.")

    assert key_lines(Other) == key_lines(Inner)
    assert Other() == Other(cap=None)
    with pytest.raises(StudyError, match=r"other\.cap is -1; give a finite positive number"):
        Other(cap=-1)


def test_every_key_has_its_line() -> None:
    lines = [(line.key, line.unit, line.default) for line in key_lines(Outer)]
    assert lines == [("name", "", '"slow"'), ("count", "", "3"), ("inner.cap", "N", "none")]


def test_toml_says_what_it_was_given() -> None:
    content = {
        "name": 'a "quoted" \\ name',
        "flags": [True, False],
        "weights": [{"energy": 0.5}, "time"],
        "inner": {"cap": 1e-9, "deep": {"x": 2}},
        "aim": {"energy": 1.0},
    }
    assert tomllib.loads(toml_text(content, inline=("aim",))) == content


def test_a_flag_goes_into_its_table() -> None:
    raw: dict[str, Any] = {"inner": {"a": 1}}
    put(raw, ("inner", "cap"), 5)
    put(raw, ("other", "deep", "x"), 6)
    assert raw == {"inner": {"a": 1, "cap": 5}, "other": {"deep": {"x": 6}}}
    with pytest.raises(StudyError, match="inner is 3 in the TOML file"):
        put({"inner": 3}, ("inner", "cap"), 5)


def test_a_long_value_is_shown_by_its_ends() -> None:
    numbers = [float(number) for number in range(200)]
    with pytest.raises(StudyError) as refused:
        study_from({"minimise": "peak-force", "duration": numbers})
    said = str(refused.value)
    assert said.startswith("duration is [0.0, 1.0, 2.0, ")
    assert said.endswith("98.0, 199.0] (200 values); give a number or [low, high] in seconds")
    assert len(said) < 250
    assert quoted([1.0, 2.0]) == "[1.0, 2.0]"
    assert len(quoted("x" * 5000)) <= SHOWN


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        ({"x" * 3000: 1}, "unknown key xxx"),
        ({"truss": {"y" * 3000: 1}}, "unknown key truss.yyy"),
        ({"truss": {"link": [1.0] * 500}}, "link is [1.0, 1.0, "),
        ({"truss": {"link": 10**400}}, "link is 1000000000000"),
        ({"truss": {"modules": 10**400}}, "truss.modules is 1000000000000"),
        ({"duration": {str(number): number for number in range(500)}}, "duration is {'0': 0, "),
    ],
)
def test_what_is_very_long_makes_no_long_sentence(raw: dict[str, Any], words: str) -> None:
    with pytest.raises(StudyError) as refused:
        study_from({"minimise": "peak-force", "duration": 6.0, **raw})
    assert words in str(refused.value)
    assert len(str(refused.value)) < 600  # of which the names of all keys of a truss take 400


def test_a_whole_number_of_thousands_of_digits_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(f"duration = {'9' * 5000}", "utf-8")
    with pytest.raises(StudyError, match="a whole number of thousands of digits; write it as"):
        read_toml(path)


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("jerc", "jerk"),
        ("pulley", "pulley_friction"),
        ("frictoin", "pulley_friction"),
        ("initial_speed", ""),
        ("motors", ""),
        ("ro", ""),
    ],
)
def test_only_a_near_miss_is_suggested(word, meant):
    known = ("jerk", "pulley_friction", "minimise", "truss", "rope_speed", "rope_jerk")
    assert nearest(word, known) == meant
