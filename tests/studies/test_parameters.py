"""The parameters that a report lists, with unit and source."""

import tomllib
from importlib.resources import files

from studies.common.study import placed
from studies.registry import mechanism_of


def parameter_lines(kind, configuration):
    """The lines of a result of a kind."""
    mechanism = mechanism_of(kind)
    return placed(mechanism.parameters)(configuration) if mechanism.parameters else []


def test_links_have_their_own_lines_and_say_what_was_stated() -> None:
    text = files("studies.flex").joinpath("examples/two-materials.toml").read_text("utf-8")
    lines = {line.name: line for line in parameter_lines("flex", tomllib.loads(text))}

    steel = lines["material steel: modulus"]
    assert (steel.value, steel.unit, steel.source) == (2.1e11, "Pa", "stated in this case")
    assert lines["link 1: length"].value == 1.5
    assert lines["joint 1: turn deg"].unit == "deg"
    # a vector is one line, a table inside a table none
    assert "link" not in lines


def test_a_default_is_called_one() -> None:
    (line,) = parameter_lines("flex", {"damping_ratio": 0.0})
    assert line.source == "by default"


def test_a_subject_without_parameters_has_no_lines() -> None:
    assert parameter_lines("paper", {"anything": 1.0}) == []
