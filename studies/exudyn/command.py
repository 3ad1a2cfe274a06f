"""`antenna-ocp arm-speed`: how long the pendulums take, beside Exudyn."""

from __future__ import annotations

import argparse
from pathlib import Path

from studies.common.console import Console
from studies.common.exit_codes import ExitCode


def add_to(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the sub-command."""
    parser = subparsers.add_parser(
        "arm-speed",
        help="simulation time of the flexible pendulums beside Exudyn (optional extra)",
        description="Moves the paper's pendulums, 8 elements a link, with our simulator and with "
        "Exudyn at equal error of the time steps, in turns, a few minutes in all. Needs the "
        "optional extra 'exudyn'. Exit code 5 if ours takes longer.",
    )
    parser.add_argument("--results", type=Path, metavar="DIR", help="a new results folder")
    parser.add_argument("--overwrite", action="store_true", help="replace the results folder")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Measure, print and write."""
    import dataclasses

    from studies.common.folder import open_results, provenance
    from studies.exudyn.peer import load
    from studies.exudyn.speed import LIMIT, ROUNDS, cases, compare, table

    version = load().__version__
    folder = open_results(options.results, "arm-speed", options.overwrite)
    found = [compare(case, console.progress) for case in cases()]
    printed = str(table(found))
    console.say(printed)
    folder.file("table.txt").write_text(f"{printed}\n", "utf-8")
    passed = all(pair.ratio <= 1.0 for pair in found)
    folder.write_json("speed.json", {
        "passed": passed, "exudyn": version, "rounds": ROUNDS, "step_error_limit_m": LIMIT,
        "rows": [{**dataclasses.asdict(pair), "ratio": pair.ratio} for pair in found],
        "made_by": provenance(),
    })  # fmt: skip
    folder.complete()
    return ExitCode.OK if passed else ExitCode.NOT_VERIFIED
