"""The code that the pages show runs as it stands, and their commands are understood."""

import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

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


@pytest.mark.parametrize("page", pages_with("python"), ids=label)
def test_python_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The blocks of a page are one script: later ones use what earlier ones define."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for number, code in enumerate(blocks(page, "python"), start=1):
        exec(compile(code, f"{page.name}, block {number}", "exec"), names)
    plt.close("all")
