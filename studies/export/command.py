"""`antenna-ocp export`: the motion of a stored result in a format that others read."""

from __future__ import annotations

import argparse
from pathlib import Path

from studies.common.console import Console
from studies.common.exit_codes import ExitCode

COLUMNS = ("csv", "json", "mat", "parquet")  # the whole profile
# tables for a drive, one a template; what begins with "_" is a part of several
TABLES = tuple(sorted(path.stem for path in (Path(__file__).parent / "templates").glob("[!_]*.j2")))
CURVES = ("segments", "c99")  # polynomials, without points
FORMATS = (*COLUMNS, *TABLES, *CURVES)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument("results", type=Path, metavar="RESULTS", help="a results folder")
    form = parser.add_mutually_exclusive_group(required=True)
    form.add_argument("--to", metavar="FORMAT", choices=FORMATS, help=", ".join(FORMATS))
    form.add_argument(
        "--template", type=Path, metavar="FILE", help="a table of your own, as a Jinja2 template"
    )
    parser.add_argument(
        "--output",
        type=Path,
        metavar="FILE",
        help="a new file, and FILE.record.json next to it; without this flag the table is printed",
    )
    _add_points(parser)
    _add_writing(parser)
    _add_stop(parser)
    parser.add_argument(
        "--within-limits",
        action="store_true",
        help="optimise again within the drive's limits if the export exceeds them",
    )


def _add_points(parser: argparse.ArgumentParser) -> None:
    """Of what, for which drive, and at which times."""
    parser.add_argument(
        "--drive",
        type=Path,
        metavar="FILE",
        help="file with the drive; by default [drive] of the study",
    )
    parser.add_argument(
        "--signal",
        metavar="NAME",
        help="rope, drum (default with several layers) or angle; of an arm, root or elbow",
    )
    parser.add_argument(
        "--motion",
        metavar="NAME",
        help="one of several motions of an arm, such as 'beside Bezier', or of a front, such as "
        "'point 3'",
    )
    parser.add_argument("--step", metavar="S", help="time between two points [s]")
    parser.add_argument(
        "--points", metavar="N", help="number of points, with the switches of the motion among them"
    )


def _add_writing(parser: argparse.ArgumentParser) -> None:
    """How numbers are written."""
    parser.add_argument(
        "--separator", metavar="SIGN", default=",", help="separator of CSV cells: , ; or tab"
    )
    parser.add_argument(
        "--decimal", metavar="SIGN", default=".", help="decimal sign of CSV: . or ,"
    )
    parser.add_argument("--no-header", action="store_true", help="CSV without header lines")
    parser.add_argument(
        "--error",
        metavar="E",
        help="maximum error of polynomial segments [m or rad]; by default 1e-9, also for the rope "
        "on a drum",
    )
    parser.add_argument(
        "--real", choices=("double", "float"), default="double", help="type of the numbers in c99"
    )


def _add_stop(parser: argparse.ArgumentParser) -> None:
    """A stop in the middle, and what follows it."""
    parser.add_argument(
        "--stop-at", metavar="S", help="the motion with a safe stop that begins at this time [s]"
    )
    parser.add_argument(
        "--resume-at",
        metavar="S",
        help="from rest after the stop that begins at this time, to the end [s]",
    )
    parser.add_argument(
        "--resume-from",
        metavar="PLACE",
        help="from rest at an angle [deg], such as 45, or a rope length, such as 24.3m, to the end",
    )
    parser.add_argument(
        "--resume-within", metavar="S", help="time of the resumed motion, to the end [s]"
    )
    parser.add_argument("--stop-within", metavar="S", help="maximum time of the stop [s]")


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Write the motion."""
    from studies.export.work import export

    return export(options, console)
