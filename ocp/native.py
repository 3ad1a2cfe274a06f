"""Functions as machine code: CasADi writes C, a compiler makes a library, which is kept.

Evaluation becomes several times faster, but a large right-hand side takes seconds to compile: it
pays on thousands of intervals, or from the second time on.
"""

from __future__ import annotations

import hashlib
import os
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import casadi as ca

from ocp.errors import StatementError

_FLAGS = ("-O2", "-shared", "-fPIC")


def compiled(functions: Sequence[ca.Function]) -> list[ca.Function]:
    """The same functions, of different names, compiled into one library.

    Raises
    ------
    StatementError
        There is no C compiler, or it fails.
    """
    generator = ca.CodeGenerator("kernel")
    for function in functions:
        generator.add(function)
    library = str(_library(generator.dump(), compiler()))
    return [ca.external(function.name(), library) for function in functions]


def compiler() -> tuple[str, ...]:
    """The command of the C compiler: ``$CC``, else ``cc``.

    Raises
    ------
    StatementError
        There is none.
    """
    command = shlex.split(os.environ.get("CC", "cc"))
    if not command or shutil.which(command[0]) is None:
        raise StatementError(
            f"compile=True needs a C compiler, and there is no '{' '.join(command)}'; install one, "
            "name it in the environment variable CC, or leave compile out"
        )
    return tuple(command)


def cache() -> Path:
    """Where compiled kernels are kept: ``$XDG_CACHE_HOME`` or ``~/.cache``."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "antenna-ocp" / "kernels"


def _library(code: str, command: tuple[str, ...]) -> Path:
    """The shared library of some C code; compiled unless it was before."""
    key = hashlib.sha256("\0".join([code, *command, *_FLAGS]).encode()).hexdigest()[:24]
    library = cache() / f"{key}.so"
    if library.exists():
        return library
    library.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        source, made = Path(folder) / "kernel.c", Path(folder) / "kernel.so"
        source.write_text(code)
        done = subprocess.run(
            [*command, *_FLAGS, str(source), "-o", str(made), "-lm"],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            raise StatementError(
                f"the C compiler '{command[0]}' failed with: {last}; name another one in the "
                "environment variable CC, or leave compile out"
            )
        made.replace(library)
    return library
