"""The file of a page: written, unless something of somebody else is there."""

from __future__ import annotations

from pathlib import Path

from studies.common.exit_codes import ExitCode, StudyError

PAGE = "report.html"


def write_page(text: str, path: Path, overwrite: bool) -> Path:
    """Write a page; an existing file is replaced if it is a report, or with --overwrite."""
    from studies.report.html import MARK

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        ours = path.exists() and MARK in path.read_text("utf-8", errors="replace")[:2000]
        if path.exists() and not (ours or overwrite):
            raise taken(path)
        path.write_text(text, "utf-8")
    except OSError as error:
        raise unwritable(path, error) from error
    return path


def taken(path: Path) -> StudyError:
    """The error that a file is there and was not to be replaced."""
    return StudyError(
        f"{path} exists already; name a folder with --to or replace it with --overwrite",
        ExitCode.NO_RESULTS_FOLDER,
    )


def unwritable(path: Path, error: OSError) -> StudyError:
    """The error that a file cannot be written."""
    return StudyError(
        f"{path} cannot be written ({error.strerror}); name a folder with --to",
        ExitCode.NO_RESULTS_FOLDER,
    )
