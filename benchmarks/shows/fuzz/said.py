"""What is wrong with the ending of a command, whatever it was given."""

from __future__ import annotations

from benchmarks.shows.truss_random import TRACEBACK
from studies.common.exit_codes import ExitCode

MARK = "antenna-ocp: "  # before each message
LONGEST = 200  # characters of a message's first line


def faults_of(code: int, said: str) -> list[str]:
    """Faults of an exit code and of all that came on standard error; empty if there are none."""
    faults = []
    if code == ExitCode.INTERNAL or code not in set(ExitCode):
        faults.append(f"exit code {code}: {said.strip().splitlines()[-1:]}")
    if found := TRACEBACK.search(said):
        faults.append(f"a traceback or the name of an error: {said[found.start() :][:LONGEST]!r}")
    messages = [line for line in said.splitlines() if line.startswith(MARK)]
    if code != ExitCode.OK and not messages and code != ExitCode.NOT_VERIFIED:
        faults.append(f"exit code {code} without a message")
    longest = max(map(len, messages), default=0)
    if longest > LONGEST:
        faults.append(f"a message whose first line has {longest} characters")
    return faults
