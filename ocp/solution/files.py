"""Files read and written whole, with one sentence where that is not possible."""

from __future__ import annotations

from pathlib import Path

from ocp.errors import FileError


def read_file(path: str | Path) -> bytes:
    """The content of a file that `ocp.save` wrote.

    Raises
    ------
    FileError
        When there is no such file, or it cannot be read.
    """
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise FileError(
            f"'{path}' cannot be read ({error.strerror}); give the path of a file that ocp.save "
            "wrote"
        ) from error


def write_file(path: str | Path, content: bytes) -> None:
    """Write a file; one that is there is replaced.

    Raises
    ------
    FileError
        When its folder is missing, or it cannot be written.
    """
    try:
        Path(path).write_bytes(content)
    except OSError as error:
        raise FileError(
            f"'{path}' cannot be written ({error.strerror}); give a path in a folder that exists "
            "and that you may write to"
        ) from error
