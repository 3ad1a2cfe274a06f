"""The command of any study: its file, a flag for each of its keys, and the order of its work."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from studies.common.configuration import closest, put, read_toml
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.key_flags import add_key_flags, key_flags, put_key_flags
from studies.common.running import (
    add_results_flags,
    add_resume_flag,
    add_study_argument,
    carry_out,
    take_up,
)
from studies.common.study import Study, placed


def add_arguments(study: Study, parser: argparse.ArgumentParser) -> None:
    """The file of a study, a flag for each of its keys, and where results go."""
    add_study_argument(parser)
    add_results_flags(parser, figures=study.figures is not None)
    if study.resumes:
        add_resume_flag(parser)
    if study.presets is not None:
        parser.add_argument(
            "--preset", metavar="NAME", help=f"in place of a file: {', '.join(_presets(study))}"
        )
    for flag, switch in study.switches.items():
        parser.add_argument(flag, action="store_true", help=switch.meaning)
    add_key_flags(parser, key_flags(study.tables(), study.without))


def run(study: Study, options: argparse.Namespace, console: Console) -> ExitCode:
    """Carry out the command of a study.

    Raises
    ------
    StudyError
        Naming the key or flag, its value and the remedy.
    """
    if study.resumes:
        take_up(study, options)
    stated = read_study(study, options, console)
    return carry_out(study, stated, _folder(study, stated, options), options, console)


def read_study(study: Study, options: argparse.Namespace, console: Console) -> Any:
    """The study that a file and flags state.

    Raises
    ------
    StudyError
        Naming the key or flag, its value and the remedy.
    """
    stated = stated_study(study, raw_study(study, options), console)
    if study.beside is None:
        return stated
    return placed(study.beside)(stated, (_file(study, options) or Path()).parent)


def stated_study(study: Study, raw: Mapping[str, Any], console: Console) -> Any:
    """The study that a nested mapping states; what models warn of is said once.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        stated = study.stated(raw)
    for warning in dict.fromkeys(str(item.message) for item in caught):
        console.progress(f"warning: {warning}")
    return stated


def raw_study(study: Study, options: argparse.Namespace) -> dict[str, Any]:
    """What a file and flags state, not yet checked.

    Raises
    ------
    StudyError
        If the file cannot be read or a flag cannot be understood.
    """
    raw = read_toml(_file(study, options))
    put_key_flags(raw, options, key_flags(study.tables(), study.without))
    for flag, switch in study.switches.items():
        if getattr(options, flag.lstrip("-").replace("-", "_")):
            for key, value in switch.states.items():
                put(raw, key.split("."), value)
    return raw


def _presets(study: Study) -> list[str]:
    """Names of the files that are handed out with a study."""
    assert study.presets is not None
    return sorted(path.stem for path in study.presets.glob("*.toml"))


def _file(study: Study, options: argparse.Namespace) -> Path | None:
    """The file of a study: the user's own, or one that is handed out with it."""
    own: Path | None = options.study
    if study.presets is None:
        return own
    preset, known = options.preset, _presets(study)
    if (own is None) == (preset is None):
        given = f"both {own} and --preset {preset} are" if preset else "no study is"
        raise StudyError(
            f"{given} given; name one STUDY.toml, or --preset with one of {', '.join(known)}"
        )
    if preset is None:
        return own
    if preset not in known:
        raise StudyError(f"there is no preset '{preset}'; {closest(preset, known)}")
    return study.presets / f"{preset}.toml"


def _folder(study: Study, stated: Any, options: argparse.Namespace) -> str:
    """Name of the results folder, unless the user names one."""
    file = _file(study, options)
    pattern = study.folder or study.kind
    return pattern.format(stated, file=study.kind if file is None else file.stem)
