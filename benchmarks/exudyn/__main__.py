"""`python -m benchmarks.exudyn`: how long the pendulums take, beside Exudyn."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from benchmarks.entry import answer_for
from benchmarks.exudyn import pairing
from studies.common.console import Console
from studies.common.exit_codes import ExitCode


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.exudyn",
        description="Moves the paper's pendulums, 8 elements a link, with our simulator and with "
        "Exudyn at equal error of the time steps, in turns, a few minutes in all. Needs Exudyn, "
        "which `make exudyn` installs first. Exit code 5 if ours takes longer.",
    )
    return answer_for(parser, run, arguments)


def run(_: argparse.Namespace, console: Console) -> ExitCode:
    """Measure and print."""
    pairs = [pairing.compare(case, console.progress) for case in pairing.cases()]
    console.say(pairing.table(pairs))
    passed = all(pair.ratio <= 1.0 for pair in pairs)
    return ExitCode.OK if passed else ExitCode.NOT_VERIFIED


if __name__ == "__main__":
    sys.exit(main())
