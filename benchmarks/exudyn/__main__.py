"""`python -m benchmarks.exudyn`: how long the pendulums take, beside Exudyn."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Sequence

from benchmarks.entry import add_results_flags, answer_for
from studies.common.console import Console
from studies.common.exit_codes import ExitCode

NAME = "exudyn"


def build_parser() -> argparse.ArgumentParser:
    """Return the flags of the command."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.exudyn",
        description="Moves the paper's pendulums, 8 elements a link, with our simulator and with "
        "Exudyn at equal error of the time steps, in turns, a few minutes in all. Needs Exudyn, "
        "which `make exudyn` installs first. Exit code 5 if ours takes longer.",
    )
    add_results_flags(parser)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    return answer_for(build_parser(), run, arguments)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Measure, print and write."""
    from benchmarks.exudyn import pairing, peer
    from studies.common.folder import open_results, provenance

    version = peer.load().__version__  # asked first: without Exudyn no folder is made
    folder = open_results(options.results, NAME, options.overwrite)
    pairs = [pairing.compare(case, console.progress) for case in pairing.cases()]

    text = str(pairing.table(pairs))
    console.say(text)
    folder.file("table.txt").write_text(f"{text}\n", "utf-8")
    passed = all(pair.ratio <= 1.0 for pair in pairs)
    record = {
        "passed": passed,
        "exudyn": version,
        "rounds": pairing.ROUNDS,
        "step_error_limit_m": pairing.LIMIT,
        "rows": [{**dataclasses.asdict(pair), "ratio": pair.ratio} for pair in pairs],
        "made_by": provenance(),
    }
    folder.write_json("speed.json", record)
    folder.complete()
    return ExitCode.OK if passed else ExitCode.NOT_VERIFIED


if __name__ == "__main__":
    sys.exit(main())
