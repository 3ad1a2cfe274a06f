"""`antenna-ocp report` with good and with bad input."""

import errno
import json
import shutil
from pathlib import Path

import pytest
from PIL import Image

from studies.cli import main
from studies.common.result import Result
from studies.common.scene import pictures
from studies.truss import figures
from studies.truss.motions.laws import deployments_of


def said(capsys):
    """The last message, whose long lines are parted."""
    return " ".join(capsys.readouterr().err.replace("\n  ", " ").strip().splitlines()[-1].split())


@pytest.mark.slow
def test_a_folder_becomes_page_figures_and_film(folder, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(pictures, "FRAMES", 4)
    monkeypatch.setattr(pictures, "HOLD", 1)
    laws = deployments_of(Result.load(folder))
    drawn = [("overview", figures.overview_figure(laws[:1], {"peak-force": 30.0}))]
    monkeypatch.setattr(figures, "all_figures", lambda laws, caps: drawn)
    flags = ["--figures", "svg", "--animation", "gif", "--to", str(tmp_path / "to")]
    assert main(["report", str(folder), *flags]) == 0
    printed = capsys.readouterr().out
    assert "global: the bound 0.000341755 is met" in printed
    assert f"the page is {tmp_path / 'to' / 'report.html'}" in printed
    assert "# the study as it was run" in (tmp_path / "to" / "report.html").read_text()
    names = {path.name for path in (tmp_path / "to" / "figures").iterdir()}
    assert names == {"overview.svg"}

    with Image.open(tmp_path / "to" / "motion.gif") as film:
        assert film.n_frames == 3  # the last two are the same picture, and GIF keeps one

    # a page of ours is replaced, figures are not
    assert main(["report", str(folder), "--to", str(tmp_path / "to")]) == 0
    assert main(["report", str(folder), *flags]) == 6
    assert "exists already; name a folder with --to" in said(capsys)


@pytest.mark.slow
def test_the_same_result_gives_the_same_page(folder, tmp_path):
    for name in "ab":
        assert main(["report", str(folder), "--to", str(tmp_path / name)]) == 0
    first, second = ((tmp_path / name / "report.html").read_bytes() for name in "ab")
    assert first == second


def test_two_folders_share_a_page(folder, tmp_path, capsys):
    other = tmp_path / "other"
    shutil.copytree(folder, other)
    assert main(["report", str(folder), str(other), "--to", str(tmp_path)]) == 0
    assert (tmp_path / "report-beside-other.html").is_file()


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (["{tmp}/nothing"], 2, "there is no results folder"),
        (["{tmp}/empty"], 2, "is no results folder of antenna-ocp"),
        (["{tmp}/begun"], 2, "report it with --partial"),
        (["{tmp}/old"], 2, "reads 1; run the study again from its input.toml"),
        (["{tmp}/newer"], 2, "reads 1; a newer antenna-ocp wrote it, so install that"),
        (["{tmp}/garbled"], 2, "is damaged or was changed (it is no archive of NumPy); run"),
        ([], 2, "0 results folders are named"),
        (["{main}", "{main}", "{main}"], 2, "3 results folders are named"),
        (["{main}", "--figures", "pictures"], 2, "'pictures' is no kind of file"),
        (["{main}", "--animation", "avi"], 2, "'avi' is no kind of file; choose from gif, mp4"),
        (["{main}", "--to", "{tmp}/file/x"], 6, "cannot be written (Not a directory)"),
        (["{main}", "--to", "{tmp}/mine"], 6, "report.html exists already"),
    ],
)
def test_bad_input_gets_one_sentence(words, code, sentence, folder, tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "report.html").write_text("my own notes")
    begun = tmp_path / "begun"
    begun.mkdir()
    (begun / "provenance.json").write_text("{}")
    shutil.copytree(folder, tmp_path / "old")
    shutil.copytree(folder, tmp_path / "newer")
    record = json.loads((folder / "result.json").read_text())
    for name, schema in (("old", 0), ("newer", 9)):
        text = json.dumps(record | {"schema": schema})
        (tmp_path / name / "result.json").write_text(text)
    shutil.copytree(folder, tmp_path / "garbled")
    (tmp_path / "garbled" / "arrays.npz").write_text("these are no arrays")

    given = [word.format(tmp=tmp_path, main=folder) for word in words]
    assert main(["report", *given]) == code
    assert sentence in said(capsys)
    assert (tmp_path / "mine" / "report.html").read_text() == "my own notes"


def test_a_folder_that_may_not_be_written_is_named(folder, tmp_path, capsys, monkeypatch):
    def refused(path, *arguments, **given):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(Path, "write_text", refused)  # a superuser may write everywhere
    assert main(["report", str(folder), "--to", str(tmp_path)]) == 6
    assert said(capsys) == (
        f"antenna-ocp: {tmp_path / 'report.html'} cannot be written (Permission denied); name a "
        "folder with --to"
    )


def test_a_folder_with_a_hostile_name_has_a_harmless_page(folder, tmp_path):
    evil = tmp_path / "<script>alert(1)<"
    shutil.copytree(folder, evil)
    assert main(["report", str(evil), str(folder), "--to", str(tmp_path)]) == 0
    text = (tmp_path / f"report-beside-{folder.name}.html").read_text()
    assert "&lt;script&gt;alert(1)" in text
    assert "<script>alert" not in text


def test_an_mp4_without_ffmpeg_is_refused_before_any_work(folder, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(pictures.shutil, "which", lambda name: None)
    assert main(["report", str(folder), "--animation", "mp4", "--to", str(tmp_path / "x")]) == 2
    assert "needs the program ffmpeg" in said(capsys)
    assert not (tmp_path / "x").exists()


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="there is no ffmpeg on this machine")
def test_an_mp4_is_written(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "FRAMES", 4)
    monkeypatch.setattr(pictures, "HOLD", 1)
    assert main(["report", str(folder), "--animation", "mp4", "--to", str(tmp_path)]) == 0
    assert (tmp_path / "motion.mp4").stat().st_size > 1000
