"""The files of a sweep's cases: one each, there as a whole or not at all.

cases/3fa41c.../version.json     which code answers here
cases/3fa41c.../0c2e....jsonl    a case: its record in one line, and its motion in a second one,
                                 where another case may start from it

A file is written beside its place, brought to the disk and renamed. Its record holds a hash of
itself, so that a damaged file is noticed.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studies.common.folder import plain, unwritable
from studies.sweep.cases.plan import CodeVersion, hashed

FOLDER, HEAD, ENDING = "cases", "version.json", ".jsonl"
HASH = "hash_of_this_record"
AGAIN = "give the same command again"  # which goes on with what is there


class DamagedCase(Exception):
    """A file of a case that cannot be trusted: it is computed again."""


@dataclass(frozen=True)
class CaseStore:
    """The cases in a results folder that one version of the code has answered.

    Attributes
    ----------
    folder : the results folder.
    version : of the code.
    """

    folder: Path
    version: CodeVersion

    @property
    def place(self) -> Path:
        """Where its files are."""
        return self.folder / FOLDER / self.version.name

    def open(self) -> None:
        """Make the folder, and try it.

        Raises
        ------
        StudyError
            If it cannot be written.
        """
        try:
            self.place.mkdir(parents=True, exist_ok=True)
            write_whole(self.place / HEAD, json.dumps(dataclasses.asdict(self.version)))
        except OSError as error:
            raise unwritable(self.folder, error, AGAIN) from error

    def keys(self) -> set[str]:
        """Keys of all files, in the order of nothing."""
        if not self.place.is_dir():
            return set()
        with os.scandir(self.place) as entries:
            return {e.name.removesuffix(ENDING) for e in entries if e.name.endswith(ENDING)}

    def read(self, key: str) -> dict[str, Any]:
        """The record of a case.

        Raises
        ------
        DamagedCase
            If its file is corrupt, or another case's.
        """
        try:
            with self._file(key).open(encoding="utf-8") as file:
                record = json.loads(file.readline())
            stated = record.pop(HASH)
        except (OSError, ValueError, KeyError, AttributeError) as error:
            raise DamagedCase(f"{type(error).__name__}: {error}") from error
        if stated != hashed(record):
            raise DamagedCase("its numbers do not fit its hash")
        if record["key"] != key:
            raise DamagedCase(f"it holds the case {record['key']}")
        return dict(record)

    def motion(self, key: str) -> dict[str, Any] | None:
        """The stored motion of a case, from which another one may start; None if it has none."""
        try:
            with self._file(key).open(encoding="utf-8") as file:
                file.readline()
                second = file.readline()
            return dict(json.loads(second)) if second.strip() else None
        except (OSError, ValueError):
            return None

    def write(self, record: Mapping[str, Any], motion: Mapping[str, Any] | None = None) -> None:
        """Keep what came of a case.

        Raises
        ------
        StudyError
            If it cannot be written, as on a full disk.
        """
        content = dict(plain(record))  # type: ignore[call-overload]
        lines = [json.dumps({**content, HASH: hashed(content)}, ensure_ascii=False)]
        if motion is not None:
            lines.append(json.dumps(plain(motion)))
        try:
            write_whole(self._file(record["key"]), "\n".join(lines) + "\n")
        except OSError as error:
            raise unwritable(self.folder, error, AGAIN) from error

    def discard(self, key: str) -> None:
        """Remove the file of a case that is computed again."""
        self._file(key).unlink(missing_ok=True)

    def others(self) -> dict[str, int]:
        """How many cases other versions of the code have left, by what these say of themselves."""
        found = {}
        for head in sorted((self.folder / FOLDER).glob(f"*/{HEAD}")):
            cases = sum(1 for _ in head.parent.glob(f"*{ENDING}"))
            if head.parent != self.place and cases:
                found[_in_words(head)] = cases
        return found

    def _file(self, key: str) -> Path:
        return self.place / f"{key}{ENDING}"


def _in_words(head: Path) -> str:
    """A version as its folder states it."""
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        stated = json.loads(head.read_text("utf-8"))
        return (
            f"{head.parent.name} (version {stated['package']}, CasADi {stated['casadi']}, "
            f"sources {stated['sources'][:8]})"
        )
    return head.parent.name


def write_whole(path: Path, text: str) -> None:
    """Write a text beside its place, bring it to the disk, and rename it."""
    draft = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        with draft.open("w", encoding="utf-8", newline="\n") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        draft.replace(path)
    except OSError:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    """Bring the new name to the disk, too, where the system can."""
    with contextlib.suppress(OSError, AttributeError):
        number = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def remove_drafts(place: Path) -> Iterator[str]:
    """Remove what a run that was killed had begun to write; names of these files."""
    for draft in sorted(place.glob("*.part")):
        draft.unlink(missing_ok=True)
        yield draft.name
