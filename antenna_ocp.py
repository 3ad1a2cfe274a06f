"""Starts the command `antenna-ocp`, after a look at where its packages come from.

A folder `models` or `studies` of the user's own, with an `__init__.py` in it, hides the installed
package of the same name as soon as it stands earlier on Python's path. The import that fails then
says nothing of the kind. So this module, which nobody else's is likely to be called, looks first.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("ocp", "models", "studies")


def hiding_sentence() -> str:
    """Say which folder or file hides a package of this project; empty if none does."""
    ours = Path(__file__).resolve().parent
    for package in PACKAGES:
        try:
            spec = find_spec(package)
        except ValueError:  # a module that was put into `sys.modules` by hand
            spec = None
        if spec is None or spec.origin is None:
            return (
                f"the package '{package}' of antenna-ocp is not where it was installed; "
                "install antenna-ocp again"
            )

        origin = Path(spec.origin)
        if origin.resolve().parent != ours / package:
            hiding = origin.parent if origin.name == "__init__.py" else origin
            return (
                f"{hiding} hides the package '{package}' of antenna-ocp; rename it, or start "
                "from another folder and without it on PYTHONPATH"
            )
    return ""


def main() -> int:
    """Run the command with the words of the process; return its exit code."""
    sentence = hiding_sentence()
    if sentence:
        sys.stderr.write(f"antenna-ocp: {sentence}\n")
        return 2  # as `studies.common.exit_codes.ExitCode.BAD_INPUT`, which may be hidden
    from studies.cli import main as run  # not before it is known to be ours

    return run()


if __name__ == "__main__":
    sys.exit(main())
