"""`antenna-ocp report --gallery`, and the page of the documents that shows it."""

import html
import re
import sys
from pathlib import Path

import pytest
from PIL import Image

from studies.cli import main
from studies.report import gallery

PENDULUM = next(entry for entry in gallery.ENTRIES if entry.subject == "flex")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The gallery of one quick study."""
    folder = tmp_path_factory.mktemp("gallery") / "to"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gallery, "ENTRIES", (PENDULUM,))
        assert main(["report", "--gallery", "--to", str(folder)]) == 0
    return folder


def test_every_link_of_the_gallery_leads_to_a_report(folder):
    text = (folder / "index.html").read_text()
    links = re.findall(r'href="([^#"]+)"', text)
    assert links == ["pendulum/report.html"]
    assert (folder / links[0]).is_file()
    assert PENDULUM.title in html.unescape(text)
    with Image.open(folder / "pendulum" / gallery.PICTURE) as picture:
        assert picture.size == (720, 320)
        assert len(picture.convert("L").getcolors()) > 10  # something is drawn


def test_a_gallery_that_is_there_is_kept(folder, capsys):
    before = (folder / "index.html").read_text()
    assert main(["report", "--gallery", "--to", str(folder)]) == 6
    assert "exists" in capsys.readouterr().err
    assert (folder / "index.html").read_text() == before


def test_the_documents_show_each_study_with_its_verdict(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[3] / "docs"))
    monkeypatch.delitem(sys.modules, "extensions", raising=False)
    from extensions.reports import page

    text = page(gallery.ENTRIES, {entry.name: "It <holds>." for entry in gallery.ENTRIES})
    for entry in gallery.ENTRIES:
        assert f'<a href="{entry.name}/report.html">' in text
    assert text.count("It &lt;holds&gt;.") == len(gallery.ENTRIES) == 5


def test_the_pendulum_is_the_papers():
    import tomllib

    import studies.flex

    path = Path(studies.flex.__file__).parent / "presets" / "single-pendulum.toml"
    preset = tomllib.loads(path.read_text("utf-8"))
    assert PENDULUM.study | {"elements": 8} == preset
