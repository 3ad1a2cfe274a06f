"""`antenna-ocp sweep`: its flags."""

from __future__ import annotations

import argparse
from pathlib import Path

from studies.common.console import Console
from studies.common.exit_codes import ExitCode
from studies.common.running import folder_path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument("study", type=Path, metavar="SWEEP.toml", help="what is swept")
    parser.add_argument(
        "--plan",
        action="store_true",
        help="say how many cases and how long, from a few of them; end",
    )
    parser.add_argument(
        "--results",
        type=folder_path,
        metavar="DIR",
        help="results folder, new or of this sweep, which then goes on "
        "[results/sweep-NAME of SWEEP.toml]",
    )

    # how it runs
    parser.add_argument("--workers", metavar="N", help="cases at a time [the number of processors]")
    parser.add_argument(
        "--case-seconds", metavar="S", help="that a case may last; then it is a row without answer"
    )
    parser.add_argument(
        "--coarse", action="store_true", help="coarse meshes, whatever the file says"
    )
    parser.add_argument(
        "--recompute",
        action="store_true",
        help="compute again what another version of the program has left in the folder",
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="a Dask scheduler, as tcp://host:8786, or 'local' for one of this machine",
    )

    # what is written
    parser.add_argument("--parquet", action="store_true", help="write the table as Parquet, too")
    parser.add_argument("--no-figures", action="store_true", help="leave the figures out")


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Carry out a sweep."""
    from studies.sweep.work import sweep

    return sweep(options, console)
