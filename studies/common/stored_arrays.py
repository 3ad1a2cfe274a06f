"""Arrays in an archive of NumPy that anybody may have written, read within a bounded memory."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ocp.arrays import Array
from ocp.solution.disk import check_room


def stored_arrays(path: Path, names: Iterable[str]) -> dict[str, Array]:
    """The arrays of these names that an archive holds.

    Raises
    ------
    ValueError
        If it is no archive of arrays of doubles, is damaged, or unpacks to more than such arrays
        do.
    """
    # what is wrong in an archive shows in many ways, in the readers of two libraries
    try:
        if not zipfile.is_zipfile(path):
            raise ValueError("it is no archive of NumPy")
        with zipfile.ZipFile(path) as archive:
            held = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            members = {name: held[name] for name in names if name in held}
            check_room(members.values(), path.stat().st_size)
            return {name: _doubles(archive, info) for name, info in members.items()}
    except Exception as error:
        raise ValueError((str(error) or type(error).__name__).splitlines()[0]) from error


def _doubles(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> Array:
    with archive.open(info) as member:
        try:
            values = np.lib.format.read_array(member, allow_pickle=False)
        except MemoryError as error:
            raise ValueError(f"{info.filename} states more numbers than it holds") from error
    if values.dtype != float:
        raise ValueError(f"{info.filename} holds {values.dtype} and no doubles")
    return values
