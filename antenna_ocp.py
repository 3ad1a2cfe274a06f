"""Starts the command `antenna-ocp`, after a look at where its packages come from.

A folder `models` or `studies` of the user's own, with an `__init__.py` in it, hides the installed
package of the same name as soon as it stands earlier on Python's path. The import that fails then
says nothing of the kind. So this module, which nobody else's is likely to be called, looks first.
"""

from __future__ import annotations

import os
import signal
import sys

PACKAGES = ("ocp", "models", "studies")


def hiding_sentence() -> str:
    """Say which folder or file hides a package of this project; empty if none does."""
    from importlib.util import find_spec
    from pathlib import Path

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


def leave(number: int, frame: object) -> None:
    """End the process at Ctrl-C, with one sentence, while packages are loaded.

    An exception in the middle of an import may come out anywhere, as another error or not at all.
    """
    os.write(2, b"antenna-ocp: interrupted; nothing was computed yet\n")
    os._exit(130)  # as `studies.common.exit_codes.ExitCode.INTERRUPTED`


def listen() -> None:
    """Let Ctrl-C raise KeyboardInterrupt from now on."""
    if signal.getsignal(signal.SIGINT) is leave:
        from studies.common.stops import interrupt

        signal.signal(signal.SIGINT, interrupt)


def main() -> int:
    """Run the command with the words of the process; return its exit code."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # nor where it is ignored
        signal.signal(signal.SIGINT, leave)
    sentence = hiding_sentence()
    if sentence:
        sys.stderr.write(f"antenna-ocp: {sentence}\n")
        return 2  # as `studies.common.exit_codes.ExitCode.BAD_INPUT`, which may be hidden
    from studies.cli import main as run  # not before it is known to be ours

    code = run(listen=listen)
    # all is done and said: Ctrl-C while the interpreter ends has nothing left to stop
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return code


if __name__ == "__main__":
    sys.exit(main())
