"""Scripts and styles of a page, of our own and of others, read from this folder."""

from __future__ import annotations

import base64
import hashlib
from pathlib import Path

FOLDER = Path(__file__).parent
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
    """A file of this folder; those of others are as they were published, to the byte."""
    return (FOLDER / name).read_bytes().decode()
