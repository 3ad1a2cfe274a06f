"""A script of the gallery that fails is named, and its page stands without picture and output."""

import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
DRAWS = 'open("one.png", "w").close()\nprint("drawn")\n'


@pytest.fixture
def gallery(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    monkeypatch.delitem(sys.modules, "extensions", raising=False)
    from extensions import gallery

    return gallery


@pytest.mark.parametrize(
    ("code", "reason"),
    [
        (DRAWS, ""),
        ("raise SystemExit('broken on purpose')\n", "broken on purpose"),
        ("print(\n", "was never closed"),
        ("print('no picture')\n", "it saves no picture one.png"),
    ],
)
def test_a_script_that_fails_says_why_and_leaves_no_old_picture(gallery, tmp_path, code, reason):
    script, made = tmp_path / "docs" / "examples" / "one.py", tmp_path / "made"
    script.parent.mkdir(parents=True)
    made.mkdir()
    script.write_text('"""Title."""\n' + DRAWS)
    assert gallery.run(script, made, "code") == ""

    script.write_text('"""Title."""\n' + code)
    failure = gallery.run(script, made, "code")
    assert reason in failure
    assert bool(failure) is bool(reason)
    assert (made / "one.png").exists() is not bool(failure)

    example = gallery.read_example(script)
    page = gallery.page(example, bool(failure))
    assert ("one.png" in page and "one.txt" in page) is not bool(failure)
    assert "one.code" in page
    assert ("one.png" in gallery.index([example], {"one"} if failure else set())) is not bool(
        failure
    )
