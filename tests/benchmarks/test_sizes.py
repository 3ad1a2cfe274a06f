"""The sizes of the engine are counted as they are said to be."""

from benchmarks import sizes

TEXT = '''"""Two lines
of a docstring."""

import casadi  # a comment
from b import value

# a comment
HALF, FIVE = 0.5, -5


def f():
    """One line."""
    return (1 +
            7)
'''


def test_lines_and_numbers_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(sizes, "ROOT", tmp_path)
    path = tmp_path / "a.py"
    path.write_text(TEXT)
    found = sizes.counted(path)
    assert (found.lines, found.docstrings, found.code, found.numbers) == (14, 3, 6, 2)
    assert (found.module, found.imports) == ("a", {"casadi", "b.value"})


def test_modules_that_import_each_other_are_a_circle(tmp_path, monkeypatch):
    monkeypatch.setattr(sizes, "ROOT", tmp_path)
    texts = {
        "a": "from b import x",
        "b": "def f():\n    import c",
        "c": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import a",
        "d": "import a",
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.py").write_text(text)
    sources = [sizes.counted(tmp_path / f"{name}.py") for name in texts]
    assert sizes.circles(sources) == []
    assert sizes.circles(sources, types=True) == [["a", "b", "c"]]
