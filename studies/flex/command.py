"""`antenna-ocp flex`: its flags, and the case that they state."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.key_flags import KeyFlags, add_key_flags, put_key_flags
from studies.common.running import Job, add_results_flags, carry_out

if TYPE_CHECKING:
    from studies.flex.config import FlexStudy

FLAGS: KeyFlags = {
    "--duration": (("duration",), "of the motion [s]"),
    "--elements": (("elements",), "of each link"),
    "--form": (("form",), "of the equations: minimal, index-1 or both"),
    "--pace": (("pace",), "multiple of the speed"),
    "--step": (("step",), "fixed step of the integrator [s]; none adapts it"),
}


def preset_folder() -> Path:
    """Where the paper's cases are."""
    return Path(__file__).parent / "presets"


def preset_names() -> list[str]:
    """Names of the paper's cases."""
    return sorted(path.stem for path in preset_folder().glob("*.toml"))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument(
        "case", nargs="?", type=Path, metavar="CASE.toml", help="a case; flags override it"
    )
    parser.add_argument(
        "--preset", metavar="NAME", help=f"a case of the paper: {', '.join(preset_names())}"
    )
    add_key_flags(parser, FLAGS)
    parser.add_argument("--no-sweep", action="store_true", help="leave the case's sweep out")
    add_results_flags(parser)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Move the chain of a case, print, write and draw the result."""
    from studies.common.configuration import toml_text
    from studies.flex.config import as_dictionary
    from studies.flex.study import check
    from studies.flex.study import run as move_chain

    study, name = read_study(options)
    configuration = as_dictionary(study)
    job = Job(
        kind="flex",
        name=f"flex-{name}",
        command="antenna-ocp flex",
        question=study.question,
        configuration=configuration,
        input_text=toml_text(configuration),
        check=lambda: check(study),
        solve=lambda: move_chain(study, console),
        draw=_draw,
    )
    return carry_out(job, options, console)


def read_study(options: argparse.Namespace) -> tuple[FlexStudy, str]:
    """The case that a file or preset and the flags on top of it state, and its name.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    from studies.common.configuration import nearest, read_toml
    from studies.flex.config import study_from
    from studies.flex.drives import with_tables

    if (options.case is None) == (options.preset is None):
        given = "both a case and a preset are" if options.case else "no case is"
        known = ", ".join(preset_names())
        raise StudyError(f"{given} given; name one CASE.toml, or --preset with one of {known}")
    path = options.case
    if path is None:
        if options.preset not in preset_names():
            near = nearest(options.preset, preset_names())
            hint = f"did you mean {near}?" if near else f"choose one of {', '.join(preset_names())}"
            raise StudyError(f"there is no preset '{options.preset}'; {hint}")
        path = preset_folder() / f"{options.preset}.toml"

    raw = read_toml(path)
    put_key_flags(raw, options, FLAGS)
    if options.no_sweep:
        raw.pop("sweep", None)
    # a CSV file is named from where its case is, and its rows become part of the case
    return with_tables(study_from(raw), path.parent), path.stem


def _draw(result: Any) -> Any:
    from studies.flex.figures import draw  # Matplotlib loads with it

    return draw(result)
