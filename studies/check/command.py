"""`antenna-ocp check`: its flags, and what it does with anyone's profile."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.check import STUDY
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.key_flags import add_key_flags, key_flags
from studies.common.running import add_results_flags, add_study_argument, hand_over
from studies.common.study_command import raw_study, stated_study

# --drive is that of an arm here, and margins are those of a motion that was found
CHECKED = replace(STUDY, without=("drive", "margin"))
LEAST_BY_DEFAULT = "peak-acceleration"  # global, in closed form wherever it keeps all caps

if TYPE_CHECKING:
    from studies.check.reading.profile import MeasuredProfile
    from studies.common.result import Result
    from studies.common.study import Study


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command: the profile, the study, and what belongs to the arm."""
    parser.add_argument(
        "profile",
        type=Path,
        metavar="PROFILE",
        help="CSV or other text with columns, JSON, .mat up to v7, or .xlsx: time, and the truss's "
        "angle or rope length, or the arm's root and elbow angles or torques",
    )
    add_study_argument(parser)
    parser.add_argument(
        "--column",
        action="append",
        default=[],
        metavar="WHAT=HEADER:UNIT",
        help="which column is time, angle, rope_length, root_angle, elbow_angle, root_torque or "
        "elbow_torque, by header or number from 1, with its unit after a colon, e.g. "
        "'angle=Winkel:deg'; 'time=row:0.01 s' counts rows; may be repeated",
    )
    for word in ("from", "to"):
        parser.add_argument(
            f"--motion-{word}",
            metavar="T",
            help=f"when the motion {'starts' if word == 'from' else 'ends'} by the time of the "
            "file [s]; by default recorded rest is detected",
        )
    parser.add_argument(
        "--study",
        dest="of",
        metavar="NAME",
        help="a study of another package that checks its profile; by default the columns decide",
    )
    parser.add_argument(
        "--no-optimum", action="store_true", help="do not compare the profile with an optimum"
    )

    add_key_flags(parser, key_flags(CHECKED.tables(), CHECKED.without))
    arm = parser.add_argument_group("for a profile of the arm")
    arm.add_argument(
        "--stage", metavar="X", help="big, small or both; by default the columns decide"
    )
    arm.add_argument(
        "--drive", metavar="X", help="torque or angle, if the profile has columns of both"
    )
    arm.add_argument("--torque-cap", metavar="X", help="cap on each driven joint [N m]")

    add_results_flags(parser)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Carry out the sub-command; a folder is written only if it is asked for."""
    study = STUDY
    if options.of is None:
        result, input_text = _ask(options, console)
    else:
        study, result, input_text = _ask_own(options, console)
    input_text = f"# Repeats this check: {_command(options)} input.toml\n\n{input_text}"

    if options.results is None:
        from studies.common.writers import exit_code, outcome_text

        console.say(outcome_text(result, every_check=True))
        return exit_code(result)

    from studies.common.folder import open_results

    # the caps of the flags are in the file: without them a rerun would check less
    folder = open_results(options.results, "check", options.overwrite)
    again = f"{_command(options)} {folder.file('input.toml')}"
    with folder.written():
        folder.file("input.toml").write_text(input_text, "utf-8")
        return hand_over(study, result, folder, again, options, console)


def _ask(options: argparse.Namespace, console: Console) -> tuple[Result, str]:
    """The check of a profile of the truss or the arm, and the study that it was held against."""
    from studies.check.reading.profile import ARM, read_profile

    measured = read_profile(options.profile, options.column)
    ask = _ask_arm if measured.mechanism == ARM else _ask_truss
    return ask(measured, options, console)


def _ask_own(options: argparse.Namespace, console: Console) -> tuple[Study, Result, str]:
    """The check of a profile of a study of another package, that study, and how it is stated."""
    from studies.check.own_study import check_own, judging_study
    from studies.common.configuration import read_toml, toml_text

    study = judging_study(options.of)
    stated = stated_study(study, read_toml(options.study), console)
    result = check_own(study, stated, options.profile, options.column, console)
    return study, result, toml_text(study.configuration(stated))


def _command(options: argparse.Namespace) -> str:
    import shlex

    words = ["antenna-ocp", "check", str(options.profile)]
    words += [word for column in options.column for word in ("--column", column)]
    for flag, name in (("motion-from", "motion_from"), ("motion-to", "motion_to"), ("study", "of")):
        if (typed := getattr(options, name)) is not None:
            words += [f"--{flag}", typed]
    return shlex.join([*words, *["--no-optimum"] * options.no_optimum])


def _check_length(measured: MeasuredProfile) -> None:
    """Refuse a length that no deployment has: most likely the unit of the times is wrong."""
    from studies.check.reading.table import refuse
    from studies.truss.limits.tolerances import check_plausible

    try:
        check_plausible("duration", measured.duration)
    except StudyError as error:
        how, *_ = measured.notes
        refuse(
            measured.path,
            f"lasts {measured.duration:g} s; most likely the unit of its time column is wrong: "
            f"{how}; else: {error}",
        )


def _ask_truss(
    measured: MeasuredProfile, options: argparse.Namespace, console: Console
) -> tuple[Result, str]:
    """The check of a profile of the truss, and the study that it was held against."""
    from studies.check.truss import check_truss
    from studies.common.configuration import toml_text
    from studies.truss.config import as_dictionary

    raw = raw_study(CHECKED, options)
    stated = None
    if "duration" in raw:
        stated = _study({"duration": raw["duration"]}, console).duration
    measured = _moving(measured, options, stated)
    _check_length(measured)
    aims = _aims_within_a_duration(raw.get("minimise", LEAST_BY_DEFAULT))
    if not aims:
        aims = LEAST_BY_DEFAULT
        console.say(
            f"the study minimises the time, but the profile takes {measured.duration:g} s: it is "
            f"compared with the minimum {LEAST_BY_DEFAULT} in this time"
        )
    study = _study({**raw, "minimise": aims, "duration": measured.duration}, console)
    result = check_truss(measured, study, stated, console, optimum=not options.no_optimum)

    content = as_dictionary(study)
    if stated is None:  # the next profile has a duration of its own
        del content["duration"]
    else:
        content["duration"] = list(stated) if stated[0] != stated[1] else stated[0]
    return result, toml_text(content, inline=("minimise",))


def _study(raw: dict[str, Any], console: Console) -> Any:
    return stated_study(CHECKED, {"minimise": "energy", **raw}, console)


def _moving(
    measured: MeasuredProfile, options: argparse.Namespace, asked: tuple[float, float] | None
) -> MeasuredProfile:
    """The profile without the rest that was recorded."""
    from studies.check.reading.rest import moving_part

    begin, end = (_instant(options, f"motion_{word}") for word in ("from", "to"))
    return moving_part(measured, begin, end, asked)


def _instant(options: argparse.Namespace, name: str) -> float | None:
    """A time of the file that the user states [s]."""
    from studies.common.configuration import as_number, finite

    text = getattr(options, name)
    return None if text is None else finite(f"--{name.replace('_', '-')}", as_number(text))


def _aims_within_a_duration(minimise: Any) -> Any:
    """The objectives of a study less the time, which a profile brings along; what is left of them.

    Anything that states no objectives stays as it is, for the study to refuse.
    """
    if isinstance(minimise, str):
        return [] if minimise == "time" else minimise
    if isinstance(minimise, dict):
        return {aim: weight for aim, weight in minimise.items() if aim != "time"}
    if isinstance(minimise, list):
        left = [_aims_within_a_duration(stage) for stage in minimise]
        return [stage for stage in left if stage not in ([], {})]
    return minimise


def _ask_arm(
    measured: MeasuredProfile, options: argparse.Namespace, console: Console
) -> tuple[Result, str]:
    """The check of a profile of the arm, and the study that it was held against."""
    from studies.arm.config import as_dictionary
    from studies.check.arm import arm_study, check_arm
    from studies.common.configuration import read_toml, toml_text

    raw = read_toml(options.study)
    own = raw.get("duration")
    measured = _moving(measured, options, (own, own) if isinstance(own, int | float) else None)
    study = arm_study(measured, raw, options.stage, options.torque_cap)
    result = check_arm(
        measured,
        study,
        options.drive or raw.get("drive"),
        console,
        optimum=not options.no_optimum,
        still="residual_energy" in raw,
    )
    return result, toml_text(as_dictionary(study))
