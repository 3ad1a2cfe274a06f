"""The folder of a show: what it was made by, a file a row, and a folder a case.

show.json               name, seed, commit and versions
rows/000017.json        one row; it is written beside and renamed, and so never half written
cases/000017/           what the case kept of its own
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.records import provenance
from benchmarks.shows.show import Row
from studies.common.exit_codes import ExitCode, StudyError

HEAD = "show.json"


@dataclass(frozen=True)
class RowStore:
    """The rows of one show and seed, made by one state of the code.

    Attributes
    ----------
    folder : Path
        Exists, and holds nothing else.
    """

    folder: Path

    def case_folder(self, index: int) -> Path:
        """Return the folder of a case, made if need be."""
        folder = self.folder / "cases" / f"{index:06}"
        folder.mkdir(parents=True, exist_ok=True)
        return folder

    def rows(self) -> dict[int, Row]:
        """Return all rows by index, in order."""
        files = sorted((self.folder / "rows").glob("*.json"))
        return {int(file.stem): json.loads(file.read_text("utf-8")) for file in files}

    def write(self, index: int, row: Row) -> None:
        """Keep a row."""
        _write(self.folder / "rows" / f"{index:06}.json", row)


def open_store(folder: Path, name: str, seed: int) -> RowStore:
    """Begin a folder, or go on with one.

    Raises
    ------
    StudyError
        If it cannot be written, holds something else, or rows that another state of the code made.
    """
    head = {"show": name, "seed": seed, **provenance()}
    try:
        if not (folder / HEAD).exists():
            _begin(folder, head)
        kept = json.loads((folder / HEAD).read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise StudyError(
            f"the folder {folder} cannot be used ({error}); name another one with --results",
            ExitCode.NO_RESULTS_FOLDER,
        ) from error

    # Rows of two commits in one table would say nothing about either.
    for key, value in head.items():
        if kept.get(key) != value:
            raise StudyError(
                f"the folder {folder} holds rows of {key} {kept.get(key)}, not {value}; "
                "name another one with --results",
                ExitCode.NO_RESULTS_FOLDER,
            )
    return RowStore(folder)


def _begin(folder: Path, head: Mapping[str, Any]) -> None:
    """Make the folder, or take an empty one; a folder of something else is left as it is."""
    others = [path.name for path in folder.iterdir()] if folder.exists() else []
    if any(name != "rows" for name in others):  # rows alone: killed before the head was written
        raise ValueError(f"it has no {HEAD}, but {', '.join(others)}")
    (folder / "rows").mkdir(parents=True, exist_ok=True)
    _write(folder / HEAD, head)


def _write(path: Path, content: Mapping[str, Any]) -> None:
    """Write JSON beside its place and rename it: an interruption leaves all or nothing."""
    draft = path.with_suffix(".part")
    draft.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", "utf-8")
    draft.replace(path)
