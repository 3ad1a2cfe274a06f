"""What tools read of the package: its version, its types, its citation."""

import re
import tomllib
from pathlib import Path

import ocp

ROOT = Path(__file__).parents[2]


def stated_version():
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]


def test_the_version_is_that_of_the_project():
    assert ocp.__version__ == stated_version()


def test_the_citation_names_the_same_version():
    (line,) = re.findall(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert line == stated_version()


def test_type_checkers_are_told_that_the_package_is_typed():
    assert (Path(ocp.__file__).parent / "py.typed").exists()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert "py.typed" in project["tool"]["setuptools"]["package-data"]["ocp"]
