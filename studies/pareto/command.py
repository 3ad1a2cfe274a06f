"""`antenna-ocp pareto truss`: its flags, which are those of the truss and a few of its own."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.running import Job, add_results_flags, add_study_argument, carry_out


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `antenna-ocp pareto truss`."""
    from studies.truss.command import add_motor_flags, add_truss_flags

    add_study_argument(parser)
    parser.add_argument(
        "--objectives",
        dest="pareto.objectives",
        metavar="A,B[,C]",
        help="two or three objectives, with commas",
    )
    parser.add_argument(
        "--points",
        dest="pareto.points",
        metavar="N",
        help="about so many on the front, 40; of three, on a slice, 10",
    )
    parser.add_argument(
        "--slices",
        dest="pareto.slices",
        metavar="N",
        help="of three objectives: how many slices, 7, or their limits, with commas [SI unit]",
    )
    parser.add_argument(
        "--range",
        dest="pareto.range",
        metavar="LOW..HIGH",
        help="limits on the objective that is limited [SI unit]",
    )
    parser.add_argument("--coarse", action="store_true", help="a sketch, in a fraction of the time")
    add_truss_flags(parser)
    add_motor_flags(parser)
    add_results_flags(parser)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Carry out `antenna-ocp pareto truss`."""
    from studies.pareto.config import as_toml, configuration_of, pareto_from
    from studies.pareto.study import asked_of
    from studies.truss.command import raw_with_motor

    study = pareto_from(_with_flags(raw_with_motor(options), options))
    check, solve = asked_of(study, console)
    job = Job(
        kind="pareto-truss",
        name=study.name,
        command="antenna-ocp pareto truss",
        question=study.question,
        configuration=configuration_of(study),
        input_text=as_toml(study),
        check=check,
        solve=solve,
        draw=_draw,
    )
    return carry_out(job, options, console)


def _with_flags(raw: dict[str, Any], options: argparse.Namespace) -> dict[str, Any]:
    """What the file states, with the flags of the trade-off on top."""
    from studies.common.configuration import as_number, put

    if options.minimise is not None:
        raise StudyError(
            f"--objective {options.minimise} is one; a trade-off needs two or three: "
            "--objectives A,B"
        )
    readers: dict[str, Callable[[str], Any]] = {
        "objectives": lambda text: [word.strip() for word in text.split(",")],
        "points": as_number,
        "slices": str,
        "range": str,
    }
    for name, read in readers.items():
        text = getattr(options, f"pareto.{name}")
        if text is not None:
            put(raw, ("pareto", name), read(text))
    if options.coarse:
        put(raw, ("pareto", "coarse"), True)
    return raw


def _draw(result: Any) -> Any:
    from studies.pareto.figures import draw  # Matplotlib loads with it

    return draw(result)
