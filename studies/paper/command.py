"""`antenna-ocp paper`: its flags, and the study that they state."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from studies.common.console import Console
from studies.common.exit_codes import ExitCode
from studies.common.key_flags import KeyFlags, add_key_flags, put_key_flags
from studies.common.running import Job, add_results_flags, add_study_argument, carry_out

if TYPE_CHECKING:
    from studies.paper.config import PaperStudy

FLAGS: KeyFlags = {
    "--duration": (("duration",), "of the deployment of the truss [s]; 140, unless stated"),
    "--elements": (("elements",), "of each link of the arm; 4, unless stated"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    add_study_argument(parser)
    add_key_flags(parser, FLAGS)
    add_results_flags(parser)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Recompute the paper, print all rows, and write and draw the result."""
    from studies.common.configuration import toml_text
    from studies.paper.config import as_dictionary
    from studies.paper.listing import outcome_text, rows_csv
    from studies.paper.study import run as recompute

    study = read_study(options)
    configuration = as_dictionary(study)
    job = Job(
        kind="paper",
        name="paper",
        command="antenna-ocp paper",
        question=study.question,
        configuration=configuration,
        input_text=toml_text(configuration),
        check=lambda: None,
        solve=lambda: recompute(study, console),
        draw=_draw,
        files=lambda result: {"rows.csv": rows_csv(result)},
        outcome=outcome_text,
    )
    return carry_out(job, options, console)


def read_study(options: argparse.Namespace) -> PaperStudy:
    """The study that a file and the flags on top of it state.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    from studies.common.configuration import read_toml
    from studies.paper.config import study_from

    raw = read_toml(options.study)
    put_key_flags(raw, options, FLAGS)
    return study_from(raw)


def _draw(result: Any) -> Any:
    from studies.paper.figures import draw  # Matplotlib loads with it

    return draw(result)
