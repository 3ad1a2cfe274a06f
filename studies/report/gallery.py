"""`antenna-ocp report --gallery`: the example studies on coarse meshes, and a page of pictures."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

from studies.common.console import Console
from studies.common.exit_codes import ExitCode
from studies.common.folder import ResultsFolder, open_results
from studies.common.result import Result
from studies.common.scene.pictures import save_strip
from studies.common.writers import write
from studies.report.html import document
from studies.report.page import SHARES, Shown, page, shown
from studies.report.page_file import PAGE, write_page
from studies.report.still import snapshots

PICTURE = "motion.png"  # beside each report, for pages that link to it


@dataclass(frozen=True)
class GalleryEntry:
    """A study of the gallery.

    Attributes
    ----------
    name : of its folder.
    title : what a visitor reads.
    subject : package of its kind in `studies`.
    study : what it states.
    """

    name: str
    title: str
    subject: Literal["truss", "arm", "flex"]
    study: Mapping[str, Any]

    def solve(self, console: Console) -> Result:
        """The result of the study."""
        kind: Any = import_module(f"studies.{self.subject}")
        result: Result = kind.run(kind.study_from(self.study), console)
        return result


_COARSE = {"intervals": 12, "starts": ["bezier"]}
_RUBBING = {"pulley_friction": 0.01}

# the main study first
ENTRIES = (
    GalleryEntry(
        "main",
        "The main study: minimum acceleration in 140 s",
        "truss",
        {
            "minimise": "peak-acceleration",
            "duration": 140.0,
            "caps": {"jerk": "bezier"},
            "truss": _RUBBING,
            "solver": _COARSE,
        },
    ),
    GalleryEntry(
        "force",
        "Minimum rope force in 5 s",
        "truss",
        {
            "minimise": "peak-force",
            "duration": 5.0,
            "caps": {"jerk": "200/T^3"},
            "truss": _RUBBING,
            "solver": _COARSE,
        },
    ),
    GalleryEntry(
        "six-modules",
        "A small antenna of six modules",
        "truss",
        {
            "minimise": "peak-rope-acceleration",
            "duration": 60.0,
            "caps": {"jerk": "bezier"},
            "truss": {"modules": 6},
            "solver": _COARSE,
        },
    ),
    GalleryEntry("big-arm", "The big arm at rest after 8.6 s", "arm", {}),
    GalleryEntry(
        "pendulum",
        "The paper's flexible pendulum falls",
        "flex",
        {
            "duration": 1.3,
            "gravity": [0.0, -9.81],
            "elements": 6,
            "frequencies": 3,
            "link": [
                {
                    "length": 1.2,
                    "area": 0.0018,
                    "second_moment": 1.215e-8,
                    "modulus": 2e9,
                    "density": 5540.0,
                }
            ],
            "joint": [{"kind": "free", "start_deg": 0.0}],
        },
    ),
)


def write_gallery(options: argparse.Namespace, console: Console) -> ExitCode:
    """Solve all studies, write report and picture of each, and the page that links to them."""
    folder = open_results(options.to, "gallery", options.overwrite)
    cards: list[tuple[GalleryEntry, Result, Shown]] = []
    for entry in ENTRIES:
        console.progress(f"{entry.title} ...")
        result = entry.solve(console)
        place = ResultsFolder(folder.file(entry.name))
        place.path.mkdir()
        write(result, place)
        write_page(page(result), place.file(PAGE), overwrite=True)
        what = shown(result)
        if what.picture is not None:
            save_strip(what.picture, place.file(PICTURE), SHARES[1:])
        cards.append((entry, result, what))
    path = write_page(gallery_page(cards), folder.file("index.html"), overwrite=True)
    folder.complete()
    console.say(f"the gallery is {path}")
    return ExitCode.OK


def gallery_page(cards: Sequence[tuple[GalleryEntry, Result, Shown]]) -> str:
    """The page that links to the reports."""
    return document(
        "gallery.html",
        "Gallery of studies",
        None,
        cards=cards,
        page=PAGE,
        stills=lambda picture: snapshots(picture, SHARES[1:]),
    )
