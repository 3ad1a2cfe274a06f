"""`antenna-ocp truss`: flags, the order of work, and what is printed and written."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError, exit_code_table
from studies.truss.quantities import OBJECTIVES

if TYPE_CHECKING:
    from studies.common.folder import ResultsFolder
    from studies.truss.config import TrussStudy
    from studies.truss.deployment import Deployment
    from studies.truss.outcome import Outcome

# flag: (place in the configuration, help). Texts are turned into numbers where they are numbers.
FLAGS: Mapping[str, tuple[tuple[str, ...], str]] = {
    "--speed-cap": (("caps", "speed"), "of the angle [rad/s]"),
    "--acceleration-cap": (("caps", "acceleration"), "of the angle [rad/s^2]"),
    "--jerk-cap": (
        ("caps", "jerk"),
        "of the angle [rad/s^3], or like 200/T^3, or bezier or step5 for that law's own peak; "
        "without one the acceleration is free at the ends",
    ),
    "--force-cap": (("caps", "force"), "of the motor on each rope [N]"),
    "--least-tension": (("caps", "least_tension"), "of every rope segment [N]"),
    "--friction": (("truss", "pulley_friction"), "mu between rope and pulley"),
    "--modules": (("truss", "modules"), "number of modules"),
    "--set": (("truss", "set"), "the paper's parameters: dynamic or kinematic"),
    "--intervals": (("solver", "intervals"), "mesh intervals to start from"),
    "--concession": (("concession",), "relative loss a later objective may cost an earlier one"),
}


def add_to(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the sub-command."""
    parser = subparsers.add_parser(
        "truss",
        help="optimal deployment of the ring truss, or --verify of a profile of your own",
        description="Finds the optimal deployment of the ring truss under stated caps, compares "
        "it with the laws of the paper, verifies, draws and exports it.",
        epilog=f"exit codes:\n{exit_code_table()}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--objective", metavar="NAME", help=", ".join(OBJECTIVES))
    parser.add_argument("--config", type=Path, metavar="TOML", help="a study; flags override it")
    parser.add_argument("--duration", metavar="T", help="[s]; LOW..HIGH leaves it free between")
    for flag, (_, text) in FLAGS.items():
        parser.add_argument(flag, metavar="X", help=text)
    parser.add_argument(
        "--parameter", action="append", default=[], metavar="NAME=VALUE",
        help="any parameter of the model, e.g. link=0.16 or net_angle_deg=82; may be repeated",
    )  # fmt: skip
    parser.add_argument("--starts", metavar="A,B", help="laws to start from, with commas")
    parser.add_argument("--results", type=Path, metavar="DIR", help="a new results folder")
    parser.add_argument("--overwrite", action="store_true", help="replace the results folder")
    parser.add_argument("--no-figures", action="store_true", help="leave the figures out")
    parser.add_argument(
        "--verify", type=Path, metavar="FILE",
        help="do not optimise: check this profile (CSV or JSON with time and angle, angle_deg or "
        "rope_length) against the same caps and model",
    )  # fmt: skip
    parser.set_defaults(run=run)


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Carry out `antenna-ocp truss`."""
    study = read_study(options, console)
    if options.verify is not None:
        return _verify(options, study, console)
    return _optimise(options, study, console)


def read_study(options: argparse.Namespace, console: Console) -> TrussStudy:
    """The study that TOML and flags state."""
    from studies.truss.config import read_toml, study_from

    raw = read_toml(options.config) if options.config is not None else {}
    if options.verify is not None:
        raw.setdefault("minimise", "peak-acceleration")  # a profile needs none
    _apply_flags(raw, options)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        study = study_from(raw)
    for warning in {str(item.message) for item in caught}:
        console.progress(f"warning: {warning}")
    return study


def _apply_flags(raw: dict[str, Any], options: argparse.Namespace) -> None:
    from studies.truss.config import as_number

    if options.objective is not None:
        raw["minimise"] = options.objective
    if options.duration is not None:
        ends = [as_number(end) for end in options.duration.split("..")]
        raw["duration"] = ends[0] if len(ends) == 1 else ends
    for flag, (place, _) in FLAGS.items():
        text = getattr(options, flag.removeprefix("--").replace("-", "_"))
        if text is not None:
            _put(raw, place, as_number(text))
    for assignment in options.parameter:
        name, equals, text = assignment.partition("=")
        if not equals:
            raise StudyError(f"--parameter is {assignment!r}; write NAME=VALUE, e.g. link=0.16")
        _put(raw, ("truss", *name.strip().split(".")), as_number(text.strip()))
    if options.starts is not None:
        _put(raw, ("solver", "starts"), options.starts.split(","))


def _put(raw: dict[str, Any], place: tuple[str, ...], value: Any) -> None:
    for table in place[:-1]:
        raw = raw.setdefault(table, {})
        if not isinstance(raw, dict):
            raise StudyError(f"{table} is {raw!r} in the TOML file; make it a table: [{table}]")
    raw[place[-1]] = value


def _optimise(options: argparse.Namespace, study: TrussStudy, console: Console) -> ExitCode:
    from studies.common.folder import open_results
    from studies.truss.checks import check_feasible
    from studies.truss.export import write_input
    from studies.truss.solve import Search

    search = Search(study, console)
    check_feasible(study, lambda: search.least_force)
    folder = open_results(options.results, study.name, options.overwrite)
    console.progress(f"results go to {folder.path}")
    write_input(folder, study)
    try:
        outcome = search.run()
    except StudyError as error:
        folder.write_json("failure.json", {"sentence": str(error), "code": error.exit_code.name})
        raise
    return _report(options, study, outcome, folder, console)


def _report(
    options: argparse.Namespace,
    study: TrussStudy,
    outcome: Outcome,
    folder: ResultsFolder,
    console: Console,
) -> ExitCode:
    """Print the table, write everything, and say whether it passed."""
    from studies.truss.compare import comparison, paper_laws
    from studies.truss.export import write_profile
    from studies.truss.report import accuracy, write_record

    laws = [outcome.deployment, *paper_laws(study.truss, outcome.deployment.law.duration)]
    table = comparison(study, laws, outcome.bounds)
    passed = write_record(folder, study, outcome)
    write_profile(folder, outcome.deployment, study, accuracy(outcome))
    folder.file("table.txt").write_text(f"{table}\n\n{outcome.verdict}\n", "utf-8")
    console.say(f"\n{table}\n")
    console.say(f"verdict: {outcome.verdict}")
    for remark in outcome.remarks:
        console.say(remark)
    _say_verification(study, outcome, console)
    interrupted = outcome.interrupted
    try:
        if not (options.no_figures or interrupted):
            _draw(laws, folder, console)
    except KeyboardInterrupt:  # all numbers are written; only figures are missing
        interrupted = True
    folder.complete()
    if interrupted:
        console.complain("interrupted; what was found until then is kept")
    console.say(f"everything is in {folder.path}; rerun: antenna-ocp truss --config "
                f"{folder.file('input.toml')}")  # fmt: skip
    if interrupted:
        return ExitCode.INTERRUPTED
    return ExitCode.OK if passed else ExitCode.NOT_VERIFIED


def _say_verification(study: TrussStudy, outcome: Outcome, console: Console) -> None:
    from studies.truss.verify import checks

    found = checks(study, outcome.deployment)
    verification = outcome.solution.verification
    failed = [check for check in found if not check.passed]
    for check in failed:
        console.say(check.sentence)
    if not failed:
        console.say(f"verified: all {len(found)} checks passed, energy balance to "
                    f"{outcome.deployment.energies.imbalance:.0e} of the motor's work")  # fmt: skip
    for name, epigraph, dense in verification.peaks:
        console.say(f"{name}: {epigraph:.9g} in the solver, {dense:.9g} replayed between points")


def _draw(laws: list[Deployment], folder: ResultsFolder, console: Console) -> None:
    from studies.common.drawing import save
    from studies.truss.figures import all_figures

    save(all_figures(laws), folder, console)
    console.progress("figures drawn")


def _verify(options: argparse.Namespace, study: TrussStudy, console: Console) -> ExitCode:
    """Check a user's profile, print the same table, and write a record if asked to."""
    from studies.truss.bounds import lower_bounds
    from studies.truss.compare import comparison, paper_laws
    from studies.truss.verify import PROFILE_MISS, checks, read_profile, record

    profile = read_profile(options.verify, study)
    folder = None
    if options.results is not None:
        from studies.common.folder import open_results

        folder = open_results(options.results, "verify", options.overwrite)
    laws = [profile, *paper_laws(study.truss, profile.law.duration)]
    table = comparison(study, laws, lower_bounds(study, None))
    found = checks(study, profile, PROFILE_MISS)
    console.say(f"{table}\n")
    for check in found:
        console.say(check.sentence)
    if folder is not None:
        folder.write_json("verification.json", record(found))
        folder.file("table.txt").write_text(f"{table}\n", "utf-8")
        if not options.no_figures:
            _draw(laws, folder, console)
        folder.complete()
    return ExitCode.OK if all(check.passed for check in found) else ExitCode.NOT_VERIFIED
