"""The files of a sweep's cases: one each, there as a whole or not at all.

cases/3fa41c.../version.json     which code answers here
cases/3fa41c.../0c2e....jsonl    a case: its record in one line, and its motion in a second one,
                                 where another case may start from it

A file is written under a temporary name, flushed to the disk and renamed. Its record has a hash of
itself and one of the motion, so that the program detects a damaged file.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studies.common.code_version import CodeVersion, hashed
from studies.common.folder import plain, unwritable
from studies.common.foreign_text import parsed_json
from studies.common.whole_files import write_whole

FOLDER, HEAD, ENDING = "cases", "version.json", ".jsonl"
HASH, MOTION = "hash_of_this_record", "hash_of_its_motion"
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
            write_whole(self.place / HEAD, json.dumps(dataclasses.asdict(self.version)).encode())
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
                record = parsed_json(file.readline())
        except OSError as error:
            raise DamagedCase(f"it cannot be read, {error.strerror}") from error
        except ValueError as error:  # wrong UTF-8 is one, too
            raise DamagedCase("it is empty, truncated or not a text") from error
        if not isinstance(record, dict) or HASH not in record:
            raise DamagedCase("it is not a record of a case")
        if record.pop(HASH) != hashed(record):
            raise DamagedCase("its numbers do not match its hash")
        if record.get("key") != key:
            raise DamagedCase(f"it contains the case {record.get('key')}")
        return record

    def has_whole_motion(self, key: str) -> bool:
        """Whether the motion of a case, or that it has none, is as it was written.

        Apart from `read`, as a motion is a hundred times as long as a record.
        """
        try:
            with self._file(key).open(encoding="utf-8") as file:
                stated = parsed_json(file.readline())[MOTION]
                return bool(stated == _digest(file.readline()))
        except (OSError, ValueError, LookupError, TypeError):
            return False

    def motion(self, key: str) -> dict[str, Any] | None:
        """The stored motion of a case, from which another one may start; None if it has none."""
        try:
            with self._file(key).open(encoding="utf-8") as file:
                file.readline()
                second = file.readline()
            return dict(parsed_json(second)) if second.strip() else None
        except (OSError, ValueError, TypeError):
            return None

    def write(self, record: Mapping[str, Any], motion: Mapping[str, Any] | None = None) -> None:
        """Keep what came of a case.

        Raises
        ------
        StudyError
            If it cannot be written, as on a full disk.
        """
        second = "" if motion is None else json.dumps(plain(motion)) + "\n"
        content = dict(plain({**record, MOTION: _digest(second)}))  # type: ignore[call-overload]
        first = json.dumps({**content, HASH: hashed(content)}, ensure_ascii=False)
        try:
            write_whole(self._file(record["key"]), f"{first}\n{second}".encode())
        except OSError as error:
            raise unwritable(self.folder, error, AGAIN) from error

    def discard(self, key: str) -> None:
        """Remove the file of a case that is computed again.

        Raises
        ------
        StudyError
            If it cannot be removed.
        """
        try:
            self._file(key).unlink(missing_ok=True)
        except OSError as error:
            raise unwritable(self._file(key), error, AGAIN) from error

    def others(self) -> dict[str, int]:
        """How many cases other versions of the code have left, by what these say of themselves."""
        found = {}
        for place in sorted((self.folder / FOLDER).glob("*/")):
            cases = sum(1 for _ in place.glob(f"*{ENDING}"))
            if place != self.place and cases:
                found[_in_words(place / HEAD)] = cases
        return found

    def _file(self, key: str) -> Path:
        return self.place / f"{key}{ENDING}"


def _digest(line: str) -> str:
    """Hash of a line as it stands in a file; empty if there is none."""
    return hashlib.sha256(line.encode()).hexdigest()[:24] if line else ""


def _in_words(head: Path) -> str:
    """A version as its folder states it."""
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        stated = parsed_json(head.read_text("utf-8"))
        return (
            f"{head.parent.name} (format {stated['schema']}, version {stated['package']}, "
            f"CasADi {stated['casadi']}, sources {stated['sources'][:8]})"
        )
    return f"{head.parent.name} (of an unknown version)"


def remove_drafts(place: Path) -> Iterator[str]:
    """Remove what a run that was killed had begun to write; names of these files."""
    for draft in sorted(place.glob("*.part")):
        draft.unlink(missing_ok=True)
        yield draft.name
