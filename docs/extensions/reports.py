"""Reports of example studies: `antenna-ocp report --gallery`, run when the site is built.

Its pages are copied into the site as they are: each is one file that asks nothing of a network.
They are kept until the code changes. If a study fails, a warning names it, and the page shows those
before it.
"""

import html
import json
import shutil
import subprocess
import sys
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.util.logging import getLogger

from extensions.gallery import fingerprint, write_if_new
from studies.report.gallery import ENTRIES, PICTURE, GalleryEntry
from studies.report.page_file import PAGE

log = getLogger(__name__)
FOLDER = Path("generated", "reports")  # of the page, in the source and in the site
RESULTS = "results"  # of the studies, below it
SECONDS = 600  # on a busy machine; some thirty on an idle one


def solve(root: Path, folder: Path, wanted: str) -> None:
    """Make the gallery of reports in `folder`, unless what is there is up to date."""
    stamp = folder.with_suffix(".stamp")
    if stamp.exists() and stamp.read_text("utf-8") == wanted and folder.is_dir():
        return
    command = ["-m", "antenna_ocp", "report", "--gallery", "--to", str(folder), "--overwrite"]
    done = subprocess.run(
        [sys.executable, *command],
        cwd=root,
        capture_output=True,
        text=True,
        timeout=SECONDS,
        check=False,
    )
    if done.returncode != 0:
        log.warning("the gallery of reports failed:\n%s", done.stderr[-2000:])
        return
    stamp.write_text(wanted, "utf-8")


def drawn(folder: Path) -> tuple[GalleryEntry, ...]:
    """The studies of the gallery in `folder` that are solved and drawn."""
    return tuple(entry for entry in ENTRIES if (folder / entry.name / PICTURE).exists())


def page(entries: tuple[GalleryEntry, ...], verdicts: dict[str, str]) -> str:
    """The page of pictures in MyST: each links to its report."""
    cards = []
    for entry in entries:
        title, link = html.escape(entry.title), f"{entry.name}/{PAGE}"
        cards += [
            "<li>",
            f'<a href="{link}"><img src="{entry.name}/{PICTURE}" alt="{title}, in motion"></a>',
            f'<p><a href="{link}">{title}</a></p>',
            f"<p>{html.escape(verdicts[entry.name])}</p>",
            "</li>",
        ]
    return "\n".join(
        [
            "# Reports\n",
            "Each picture opens the report of a study: its answer, curves to read off, and what "
            "moves.",
            "The studies were solved on coarse meshes while this site was built, with "
            "`antenna-ocp report --gallery`.",
            "[How to show a result](../../how-to/show-results.md) says what is on such a page.\n",
            "```{raw} html",
            '<div class="gallery reports"><ul>',
            *cards,
            "</ul></div>",
            "```\n",
        ]
    )


def _verdict(folder: Path) -> str:
    record = json.loads((folder / "result.json").read_text("utf-8"))
    sentence = str(record["verdict"]["sentence"])
    return f"{sentence[:1].upper()}{sentence[1:]}."


def _build(app: Sphinx) -> None:
    source = Path(app.srcdir)
    folder = source / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    solve(source.parent, folder / RESULTS, fingerprint(source.parent))
    entries = drawn(folder / RESULTS)
    verdicts = {entry.name: _verdict(folder / RESULTS / entry.name) for entry in entries}
    write_if_new(folder / "index.md", page(entries, verdicts))


def _copy(app: Sphinx, failure: Exception | None) -> None:
    """Put the reports and their pictures beside the page that shows them."""
    if failure is not None or app.builder.format != "html":
        return
    for entry in drawn(Path(app.srcdir) / FOLDER / RESULTS):
        target = Path(app.outdir) / FOLDER / entry.name
        target.mkdir(parents=True, exist_ok=True)
        for name in (PAGE, PICTURE):
            shutil.copyfile(Path(app.srcdir) / FOLDER / RESULTS / entry.name / name, target / name)


def setup(app: Sphinx) -> dict[str, bool]:
    """Solve before Sphinx looks for pages; copy before the site is checked."""
    app.connect("builder-inited", _build)
    app.connect("build-finished", _copy, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
