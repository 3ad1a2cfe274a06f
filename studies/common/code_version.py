"""Which code answers: what one version has computed is never taken for what another would say."""

from __future__ import annotations

import functools
import hashlib
import json
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import models
import ocp
import studies
from studies.common.folder import PROGRAM, plain, version

SCHEMA = 1  # of stored answers; raised when a field changes its meaning or disappears


@dataclass(frozen=True)
class CodeVersion:
    """What answers: two versions that differ in one of these are never mixed.

    Attributes
    ----------
    schema : of the files.
    package : version of this package.
    casadi : version of CasADi, whose solver decides the last digits.
    sources : hash of the sources of models, engine and studies.
    """

    schema: int
    package: str
    casadi: str
    sources: str

    @property
    def name(self) -> str:
        """Short name, for a folder."""
        return hashed([self.schema, self.package, self.casadi, self.sources])[:12]


@functools.cache
def code_version(packages: tuple[str, ...] = ("",)) -> CodeVersion:
    """The version of the code that runs.

    Parameters
    ----------
    packages : tuple of str
        Those of `studies` that answer; all by default.
    """
    digest = hashlib.sha256()
    roots = [Path(next(iter(package.__path__))) for package in (models, ocp)]
    roots += [Path(next(iter(studies.__path__))) / name for name in packages]
    for root in roots:
        for file in sorted(root.rglob("*.py")):
            digest.update(str(file.relative_to(root.parent)).encode() + b"\0")
            digest.update(file.read_bytes() + b"\0")
    return CodeVersion(SCHEMA, version(PROGRAM), metadata.version("casadi"), digest.hexdigest())


def hashed(content: Any) -> str:
    """Hash of what JSON can hold, the same on every machine."""
    text = json.dumps(plain(content), sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()
