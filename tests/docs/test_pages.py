"""The code that the pages show runs as it stands, and their commands are understood."""

import re
import shlex
import tomllib
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

import studies.arm
import studies.codesign
import studies.flex
import studies.pareto
import studies.robust
import studies.sweep
from models.laws import JerkLimited
from studies.check.command import CHECKED
from studies.cli import parse
from studies.common.console import Console, number
from studies.common.exit_codes import StudyError
from studies.common.study_command import raw_study, read_study, stated_study
from studies.truss.command import STUDY as TRUSS
from studies.truss.config import DEPLOYED, study_from
from studies.truss.limits.feasibility import check_feasible
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import paper_laws
from studies.truss.motions.phase_plane import LeastForce
from studies.truss.quantities import QUANTITIES

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(
    page
    for folder in ("tutorial", "how-to", "explanation", "reference")
    for page in (DOCS / folder).glob("*.md")
)


def blocks(page: Path, language: str) -> list[str]:
    """Code blocks of a language, in order."""
    text = page.read_text("utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def pages_with(language: str) -> list[Path]:
    """Pages that show code of a language."""
    return [page for page in PAGES if blocks(page, language)]


def label(page: Path) -> str:
    """Folder and name of a page."""
    return f"{page.parent.name}/{page.stem}"


# pages with code that takes two seconds and more
LONG = {
    *("equations", "failed-solve", "first-problem", "other-optima", "paper", "peaks"),
    *("results-folder", "settings", "show-results", "trade-offs", "warm-starts"),
}


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=label(page), marks=[pytest.mark.slow] * (page.stem in LONG))
        for page in pages_with("python")
    ],
)
def test_python_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The blocks of a page are one script: later ones use what earlier ones define."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for place, code in enumerate(blocks(page, "python"), start=1):
        exec(compile(code, f"{page.name}, block {place}", "exec"), names)
    plt.close("all")


@pytest.mark.parametrize("page", pages_with("toml"), ids=label)
def test_toml_states_a_study(page: Path) -> None:
    readers = {
        "own-arm": studies.arm.study_from,
        "flexible-links": studies.flex.study_from,
        "trade-offs": studies.pareto.study_from,
        "sweeps": studies.sweep.study_from,
        "co-design": studies.codesign.study_from,
        "robust": studies.robust.study_from,
    }
    read = readers.get(page.stem, study_from)
    for text in blocks(page, "toml"):
        stated = tomllib.loads(text)
        assert (studies.sweep.study_from if "subject" in stated else read)(stated).question


def test_the_first_study_of_a_truss_of_ones_own_is_feasible() -> None:
    """By statics and all that is proven in closed form, without a search."""
    text = blocks(DOCS / "how-to" / "own-truss.md", "toml")[0]

    def no_bound() -> LeastForce:
        raise StudyError("the phase plane takes too long here")

    check_feasible(study_from(tomllib.loads(text)), no_bound)


def commands() -> list[str]:
    """Command lines that the pages show."""
    lines: list[str] = []
    for page in PAGES:
        lines += re.findall(r"^antenna-ocp (.*)$", page.read_text("utf-8"), re.MULTILINE)
    return list(dict.fromkeys(lines))


@pytest.mark.parametrize("line", commands())
def test_commands_are_understood(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    files = {
        "mine": "how-to/own-truss",
        "drive": "how-to/mechanism-limits",
        "margin": "how-to/margins",
        "rotor": "explanation/rotor",
        "ring": "explanation/ring-on-arm",
    }
    for name, page in files.items():
        text = blocks(DOCS / f"{page}.md", "toml")[0]
        (tmp_path / f"{name}.toml").write_text(text)
    options, _ = parse(shlex.split(line, comments=True))
    if line.startswith("truss") and "--resume" not in line:
        read_study(TRUSS, options, Console())
    if line.startswith("check"):  # a profile has its own duration, and needs no objective
        raw = {"minimise": "energy", "duration": 1.0, **raw_study(CHECKED, options)}
        stated_study(CHECKED, raw, Console())


def test_targets_that_are_named_exist() -> None:
    makefile = (DOCS.parent / "Makefile").read_text("utf-8")
    for page in PAGES:
        text = page.read_text("utf-8")
        for target in set(re.findall(r"(?:`|^)make ([a-z-]+)", text, re.MULTILINE)):
            assert f"\n{target}:" in makefile, f"{label(page)}: make {target}"


def test_files_that_are_named_exist() -> None:
    for page in PAGES:
        text = page.read_text("utf-8")
        for path in re.findall(r"`((?:ocp|models|studies|docs|tests)/[\w./-]+)`", text):
            assert (DOCS.parent / path).exists(), f"{label(page)}: {path}"


def test_the_main_study_prints_the_table_of_the_tutorial() -> None:
    """The rows that the tutorial shows, from the laws and bounds in closed form."""
    page = (DOCS / "tutorial" / "main-study.md").read_text("utf-8")
    study = study_from(tomllib.loads((DOCS.parent / "studies/truss/main.toml").read_text("utf-8")))
    T, truss = study.duration[0], study.truss
    law = JerkLimited(T, truss.stowed_angle, DEPLOYED, study.caps.jerk)
    columns = [Deployment("optimal", law, truss), *paper_laws(truss, T)]
    rows = re.findall(r"^\| (peak .*?) \[.*?\] \| (.*) \| .* \| .* \|$", page, re.MULTILINE)
    assert len(rows) == 4
    for title, cells in rows:
        (key,) = (key for key, quantity in QUANTITIES.items() if quantity.title == title)
        assert cells == " | ".join(number(column.values[key], 6) for column in columns), title
