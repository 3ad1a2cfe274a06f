"""The README's code runs, its numbers are what the commands print, what it names exists."""

import re
from pathlib import Path

import pytest

from models.laws import least_peak_acceleration
from models.truss import DYNAMIC_SET
from studies.common.console import number
from studies.truss.config import DEPLOYED, law_jerk
from studies.truss.motions.laws import paper_laws

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text("utf-8")


def blocks(language: str) -> list[str]:
    """Code blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


def test_it_is_short() -> None:
    assert len(README.splitlines()) <= 150


def test_the_textbook_problem_has_its_optimum() -> None:
    (code,) = blocks("python")
    lines = [line for line in code.splitlines() if line.strip()]
    assert len(lines) <= 10
    names: dict[str, object] = {"print": lambda *_: None}
    exec(compile(code, "README.md", "exec"), names)
    solution = names["solution"]
    # 4/(9 l) with l = 1/9; the engine's own tolerance on an objective is 1e-5
    assert solution.objective == pytest.approx(4.0, rel=1e-6)  # type: ignore[attr-defined]
    assert solution.verification.passed  # type: ignore[attr-defined]


def test_the_main_study_prints_the_numbers() -> None:
    T, start = 140.0, DYNAMIC_SET.stowed_angle
    best = least_peak_acceleration(DEPLOYED - start, T, jerk=law_jerk("bezier", T, start))
    values = [law.values["peak-acceleration"] for law in paper_laws(DYNAMIC_SET, T)]
    cells = " | ".join(number(value, 6) for value in (best, *values, best))
    assert f"| peak angular acceleration [rad/s^2] | {cells} |" in README


def test_files_and_targets_that_are_named_exist() -> None:
    for link in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / link).exists(), link
    makefile = (ROOT / "Makefile").read_text("utf-8")
    for target in set(re.findall(r"(?:`|^)make ([a-z-]+)", README, re.MULTILINE)):
        assert f"\n{target}:" in makefile, target
