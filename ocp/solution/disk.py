"""Files read and written whole, with one sentence if that is not possible."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable
from pathlib import Path

from ocp.errors import FileError

# bytes that an archive may unpack to: constant arrays pack a thousandfold, others up to fourfold
_ROOM, _TIMES_THE_ARCHIVE = 32_000_000, 4
_ENCRYPTED = 0x1  # among the flags of a member


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
            f"'{path}' cannot be written ({error.strerror}); give a path in an existing folder "
            "with write permission"
        ) from error


def check_room(members: Iterable[zipfile.ZipInfo], size: int) -> None:
    """Refuse an archive that somebody else may have made, before it fills the memory.

    Parameters
    ----------
    members : of the archive, that are to be read.
    size : of the archive [bytes].

    Raises
    ------
    ValueError
        If they unpack to far more than what is stored does, or are encrypted.
    """
    members = list(members)
    unpacked = sum(member.file_size for member in members)
    if unpacked > _ROOM + _TIMES_THE_ARCHIVE * size:
        raise ValueError(f"it unpacks to {unpacked / 1e6:.0f} MB, too much for its size")
    if any(member.flag_bits & _ENCRYPTED for member in members):
        raise ValueError("it is encrypted")
