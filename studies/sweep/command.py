"""`antenna-ocp sweep`: its flags."""

from __future__ import annotations

import argparse
from pathlib import Path

from studies.common.console import Console
from studies.common.exit_codes import ExitCode
from studies.common.running import folder_path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument("study", type=Path, metavar="SWEEP.toml", help="the file of the sweep")
    parser.add_argument(
        "--plan",
        action="store_true",
        help="only print the number of cases, and the estimated time from a few of them",
    )
    parser.add_argument(
        "--results",
        type=folder_path,
        metavar="DIR",
        help="results folder: a new one, or the one of this sweep to resume it "
        "[results/sweep-NAME of SWEEP.toml]",
    )

    # how it runs
    parser.add_argument("--workers", metavar="N", help="cases at a time [the number of processors]")
    parser.add_argument(
        "--case-seconds",
        metavar="S",
        help="time limit of a case, after which its row has no answer",
    )
    parser.add_argument(
        "--coarse", action="store_true", help="coarse meshes, whatever the file says"
    )
    parser.add_argument(
        "--recompute",
        action="store_true",
        help="recompute the cases in the folder that another version of the program solved",
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="a Dask scheduler, as tcp://host:8786, or 'local' for one of this machine",
    )

    # what is written
    parser.add_argument("--parquet", action="store_true", help="also write the table as Parquet")
    parser.add_argument("--no-figures", action="store_true", help="draw no figures")


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Carry out a sweep."""
    from studies.sweep.work import sweep

    return sweep(options, console)
