"""`python -m benchmarks.page RESULTS`: how fast a report opens and moves, in a real browser.

Opening is the time from the start of the navigation until the script has made the page ready to be
used. It stands beside that of a page that only loads the libraries. A frame is an instant of the
motion drawn with what follows it on the screen, and read back from the canvas, so that nothing is
left to be painted later.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
from pathlib import Path

from benchmarks.page.chromium import Tab, browser_tab, find_chromium
from studies.common.console import Console, Table, number
from studies.common.exit_codes import StudyError
from studies.common.result import Result
from studies.report import assets
from studies.report.command import input_text
from studies.report.html import element
from studies.report.page import page

RUNS = 5
LARGEST = 4.0  # MB
SLOWEST_OPENING = 1.0  # [s] above the libraries
SLOWEST_FRAME = 0.040  # [s] above an empty frame

_READY = (
    "new Promise(done => setTimeout(() => done(Number(document.documentElement.dataset.ready))))"
)
_FRAMES = """
(async () => {
  report.charts.all();
  await new Promise(done => setTimeout(done, 500));
  const canvas = document.querySelector("#stage canvas");
  const pixel = () => canvas.getContext("2d").getImageData(0, 0, 1, 1);
  pixel();
  const times = [];
  for (let k = 0; k < 24; k++) {
    const start = performance.now();
    report.seek(report.motion.duration() * k / 23, "benchmark");
    report.motion.draw();
    await null; // the charts move their cursors behind the present task
    pixel();
    times.push(performance.now() - start);
  }
  return times.sort((a, b) => a - b)[12];
})()
"""


def main() -> int:
    """Measure, print and compare with what is allowed."""
    parser = argparse.ArgumentParser(description="How fast a report opens and moves.")
    parser.add_argument("results", type=Path, metavar="RESULTS", help="a results folder")
    options = parser.parse_args()
    console = Console()
    chromium = find_chromium()
    if chromium is None:
        console.complain("there is no Chromium on the PATH; install one")
        return 2
    try:
        text = page(Result.load(options.results), input_text(options.results))
    except StudyError as error:
        console.complain(str(error))
        return int(error.exit_code)

    with tempfile.TemporaryDirectory() as folder, browser_tab(chromium) as tab:
        tab.size(1280, 900)
        report, libraries = Path(folder) / "report.html", Path(folder) / "libraries.html"
        report.write_text(text, "utf-8")
        libraries.write_text(_libraries(), "utf-8")
        # in turn, so that what else the machine does meets both alike
        openings = [(_opened(tab, libraries), _opened(tab, report)) for _ in range(RUNS)]
        frames = []
        for _ in range(RUNS):
            _opened(tab, report)
            frames.append(tab.run(_FRAMES) / 1000)

    rest, opening = (statistics.median(column) for column in zip(*openings, strict=True))
    frame, size = statistics.median(frames), len(text.encode()) / 1e6
    rows = [
        ("size [MB]", number(size, 4), number(LARGEST)),
        ("opening, libraries alone [s]", number(rest, 3), ""),
        ("opening, report [s]", number(opening, 3), ""),
        ("opening, above the libraries [s]", number(opening - rest, 3), number(SLOWEST_OPENING)),
        (
            "a frame, the charts on the screen following [s]",
            number(frame, 3),
            number(SLOWEST_FRAME),
        ),
    ]
    console.say(
        Table(f"Medians of {RUNS} in one run, {Path(chromium).name}", ("", "", "allowed"), rows)
    )
    met = size < LARGEST and opening - rest <= SLOWEST_OPENING and frame <= SLOWEST_FRAME
    return 0 if met else 1


def _opened(tab: Tab, path: Path) -> float:
    tab.open(path.as_uri())
    return float(tab.run(_READY)) / 1000


def _libraries() -> str:
    """A page that loads what others made, and nothing else."""
    from studies.report.html import written

    script = assets.read("uplot.iife.min.js")
    ready = "document.documentElement.dataset.ready = performance.now();"
    tree = element(
        "html",
        element("head", element("style", assets.read("uplot.min.css"))),
        element("body", element("script", f"{script}\n{ready}")),
    )
    return f"<!DOCTYPE html>\n{written(tree)}"


if __name__ == "__main__":
    sys.exit(main())
