"""The rules of CONTRIBUTING.md that can be counted."""

import ast
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("ocp", "models", "studies", "benchmarks")


def modules():
    return [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


def test_a_class_name_stands_in_one_file_only():
    counts = Counter(
        node.name
        for path in modules()
        for node in ast.parse(path.read_text("utf-8")).body
        if isinstance(node, ast.ClassDef)
    )
    assert not {name: n for name, n in counts.items() if n > 1}


@pytest.mark.parametrize("package", PACKAGES)
def test_each_package_says_what_it_is(package):
    for folder in (ROOT / package, *(p for p in (ROOT / package).rglob("*") if p.is_dir())):
        start = folder / "__init__.py"
        if start.is_file():
            assert ast.get_docstring(ast.parse(start.read_text("utf-8"))), folder
