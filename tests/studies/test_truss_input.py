"""Contradictory and absurd input of the truss, and profiles that are none: one sentence each."""

from pathlib import Path

import pytest

from studies.cli import main
from studies.common.exit_codes import ExitCode
from studies.truss.limits.tolerances import PLAUSIBLE

TIMELESS = ("truss", "--objective", "peak-force", "--jerk-cap", "200/T^3")
FAST = (*TIMELESS, "--duration", "5")


def sentence(words, capsys, code=ExitCode.BAD_INPUT):
    """The sentence with which a command line is refused; a long one stands in several lines."""
    assert main(list(words)) == code
    first, *further = capsys.readouterr().err.splitlines()
    assert all(line.startswith("  ") for line in further)
    return " ".join([first, *map(str.strip, further)])


def test_a_flag_that_is_given_twice_is_refused(capsys):
    said = sentence([*FAST, "--duration=6"], capsys)
    assert said == "antenna-ocp: --duration is given twice; remove one of them"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--parameter", "modules=12", "--modules", "24"), "state the same thing"),
        (("--parameter", "pulley_friction=0.1", "--friction", "0.2"), "state the same thing"),
        (("--parameter", "link=0.2", "--parameter", "link=0.3"), "state the same thing"),
        (("--parameter", "net_angle=1.4", "--parameter", "net_angle_deg=82"), "the same thing"),
        (("--parameter", "=3"), "write NAME=VALUE"),
        (("--parameter", "link="), "write NAME=VALUE"),
        (("--concession", "2"), "give a fraction below 1"),
        (("--duration", "2.."), "give both ends in seconds"),
        (("--results", ""), "name a folder"),
        (("--resume", "nowhere"), "allows no other arguments, but --objective is given"),
    ],
)
def test_contradictory_and_half_input_is_refused(words, said, capsys) -> None:
    base = TIMELESS if "--duration" in words else FAST
    assert said in sentence([*base, *words], capsys)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--duration", "1e-9"), "below the limit of 0.1 s: sound takes"),
        (("--duration", "1e9"), "above the limit of 1e+06 s"),
        (("--least-tension", "1e6"), "above the limit of 10000 N: a rope of 3 mm breaks"),
        (("--force-cap", "1e300"), "above the limit of 1e+07 N: a rope of 3 mm breaks"),
        (("--force-cap", "1e10"), "leave the cap out where nothing limits the force"),
        (("--modules", "100000000"), "above the limit of 2000: a ring of"),
        (("--friction", "5"), "above the limit of 1: no rope on a pulley"),
        (("--friction", "1000"), "above the limit of 1: no rope on a pulley"),
        (("--intervals", "100000000"), "above the limit of 2000"),
        (("--parameter", "spring_stiffness=1e12"), "above the limit of 1e+07 N/m"),
    ],
)
def test_absurd_input_is_refused_with_limit_and_reason(words, said, capsys) -> None:
    base = TIMELESS if "--duration" in words else FAST
    assert said in sentence([*base, *words], capsys)


def test_what_is_absurd_leaves_the_paper_alone() -> None:
    assert all(allowed.low < allowed.high and allowed.reason for allowed in PLAUSIBLE.values())


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ('minimise = ["peak-force", "peak-force"]', "contains peak-force 2 times"),
        ('minimise = "energy"\n[truss]\nnet_angle = 1.4\nnet_angle_deg = 82', "the same angle"),
        ("duration = 5\n[caps]\njerc = 1", "did you mean caps.jerk?"),  # before the objective
    ],
)
def test_contradictory_files_are_refused(content, said, tmp_path: Path, capsys) -> None:
    file = tmp_path / "a.toml"
    file.write_text(content)
    assert said in sentence(["truss", str(file)], capsys)


def test_a_file_that_is_no_text_is_named(tmp_path: Path, capsys) -> None:
    file = tmp_path / "a.toml"
    file.write_bytes(b"\xff\xfe\x00")
    assert "is not text in UTF-8" in sentence(["truss", str(file)], capsys)
