"""An environment of its own for each peer, made once from its pinned requirements."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.race.contestants import Contestant

READY = "ready"
LIMIT = 900.0  # [s] for each step


class NotInstalled(Exception):
    """A peer's environment could not be made; the text says why in one sentence."""


def python_of(peer: Contestant, parent: Path) -> Path:
    """Return the peer's interpreter, in a folder of `parent` that is made unless it is ready.

    Raises
    ------
    NotInstalled
        If the requirements cannot be installed within `LIMIT` seconds.
    """
    # Another interpreter or another pin is another environment: the folder's name tells.
    text = peer.requirements.read_text("utf-8")
    digest = hashlib.sha256(f"{sys.version}{text}".encode()).hexdigest()[:10]
    folder = (parent / f"{peer.name}-{digest}").resolve()
    python = folder / "bin" / "python"
    if (folder / READY).is_file():
        return python

    pip = [str(python), "-m", "pip", "install", "--quiet"]
    flags = ["--disable-pip-version-check", "--no-input", "-r", str(peer.requirements)]
    run_step([sys.executable, "-m", "venv", "--clear", str(folder)])
    run_step([*pip, *flags])

    # Written last: a folder without it was interrupted and is made again.
    (folder / READY).write_text(text, "utf-8")
    return python


def run_step(command: Sequence[str]) -> None:
    """Run one step of an installation.

    Raises
    ------
    NotInstalled
        If it fails or takes longer than `LIMIT`.
    """
    try:
        subprocess.run(
            command,
            check=True,
            capture_output=True,
            text=True,
            timeout=LIMIT,
            stdin=subprocess.DEVNULL,
        )
    except subprocess.TimeoutExpired as error:
        raise NotInstalled(f"not installed after {LIMIT:g} s") from error
    except subprocess.CalledProcessError as error:
        lines = [line for line in error.stderr.splitlines() if line.startswith("ERROR")]
        raise NotInstalled(f"not installed: {(lines or ['unknown reason'])[-1]}") from error
    except OSError as error:
        raise NotInstalled(f"not installed: {error}") from error
