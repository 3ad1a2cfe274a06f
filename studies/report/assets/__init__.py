"""Scripts and styles of a page, of our own and of others, read from this folder and checked."""

from __future__ import annotations

import base64
import hashlib
import tomllib
from pathlib import Path

from studies.common.exit_codes import ExitCode, StudyError

FOLDER = Path(__file__).parent
VENDORED = "vendored.toml"
STYLES = ("uplot.min.css", "report.css")
SCRIPTS = ("uplot.iife.min.js", "data.js", "charts.js", "motion.js", "tables.js", "start.js")


def styles() -> str:
    """All styles of a page."""
    return "\n".join(read(name) for name in STYLES)


def scripts() -> str:
    """All scripts of a page, as one."""
    return "\n".join(read(name) for name in SCRIPTS)


def policy(script: str) -> str:
    """The content security policy of a page: no network, and no script but this one.

    Styles may stand in the page: those of the still pictures are attributes.
    """
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )


def read(name: str) -> str:
    """A file of this folder; one of others only as it was published.

    Raises
    ------
    StudyError
        If the file is not there or was changed: a page never links to it instead.
    """
    expected = vendored_hashes().get(name)
    content = _bytes(name)
    if expected is not None and hashlib.sha256(content).hexdigest() != expected:
        raise StudyError(
            f"the file {FOLDER / name} is not what {VENDORED} says; install antenna-ocp again",
            ExitCode.INTERNAL,
        )
    return content.decode()


def vendored_hashes() -> dict[str, str]:
    """SHA-256 of each file that others made, by its name."""
    packages = tomllib.loads(_bytes(VENDORED).decode()).values()
    return {name: digest for package in packages for name, digest in package["sha256"].items()}


def _bytes(name: str) -> bytes:
    try:
        return (FOLDER / name).read_bytes()
    except OSError as error:
        raise StudyError(
            f"the file {FOLDER / name}, of which a report is made, cannot be read "
            f"({error.strerror}); install antenna-ocp again",
            ExitCode.INTERNAL,
        ) from error
