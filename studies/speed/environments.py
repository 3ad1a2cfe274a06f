"""An environment of its own for each peer, made once from its pinned requirements."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

from studies.speed.contestants import Contestant

READY = "ready"
LIMIT = 900.0  # [s] for each step


class NotInstalled(Exception):
    """A peer's environment could not be made; the text says why in one sentence."""


def python_of(peer: Contestant, parent: Path) -> Path:
    """The peer's interpreter, in a folder of `parent` that is made unless it is there and ready.

    Raises
    ------
    NotInstalled
        If the requirements cannot be installed within `LIMIT` seconds.
    """
    text = peer.requirements.read_text("utf-8")
    digest = hashlib.sha256(f"{sys.version}{text}".encode()).hexdigest()[:10]
    folder = (parent / f"{peer.name}-{digest}").resolve()
    python = folder / "bin" / "python"
    if (folder / READY).is_file():
        return python
    install = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check",
               "--no-input", "-r", str(peer.requirements)]  # fmt: skip
    for command in ([sys.executable, "-m", "venv", "--clear", str(folder)], install):
        _done(command)
    (folder / READY).write_text(text, "utf-8")
    return python


def _done(command: list[str]) -> None:
    try:
        subprocess.run(
            command, check=True, capture_output=True, text=True, timeout=LIMIT,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        raise NotInstalled(f"not installed after {LIMIT:g} s") from error
    except subprocess.CalledProcessError as error:
        lines = [line for line in error.stderr.splitlines() if line.startswith("ERROR")]
        raise NotInstalled(f"not installed: {(lines or ['unknown reason'])[-1]}") from error
    except OSError as error:
        raise NotInstalled(f"not installed: {error}") from error
