"""`antenna-ocp arm`: flags, the order of work, and what is printed and written."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError

if TYPE_CHECKING:
    from models.arm.reduced_simulation import ReducedMotion
    from studies.arm.config import ArmStudy
    from studies.arm.replay.full import Array, Replay
    from studies.common.folder import ResultsFolder

SHARES = {"big": 0.01, "small": 0.03, "both": 0.03}  # of a baseline's E_res


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the sub-command."""
    parser.add_argument("--stage", metavar="NAME", help="big, small or both")
    parser.add_argument(
        "--objective", metavar="NAME",
        help="what is least: smoothest (the torque's), peak-torque, peak-tip-acceleration, energy, "
        "time (needs both caps), peak-root-reaction, deflection",
    )  # fmt: skip
    parser.add_argument("--config", type=Path, metavar="TOML", help="a study; flags override it")
    for name in _numbers():
        parser.add_argument(f"--{name.replace('_', '-')}", metavar="X", help=_numbers()[name])
    parser.add_argument(
        "--baselines", choices=("torque", "angle"),
        help="set an optimum of no higher peak torque beside each baseline, under this drive",
    )  # fmt: skip
    parser.add_argument(
        "--least-duration", choices=("torque", "angle"),
        help="least durations of the optimum and of each baseline that leave at most 1e-6 J under "
        "the Bezier law's peak torque, under this drive",
    )  # fmt: skip
    parser.add_argument(
        "--trade-off", action="store_true",
        help="residual energy of the smoothest motion and the smooth laws against duration",
    )  # fmt: skip
    parser.add_argument(
        "--sequence", choices=("peak-torque", "time"),
        help="big arm, locked dwell and small arm as one problem: least common peak torque in "
        "--total, or least time under --torque-cap",
    )  # fmt: skip
    parser.add_argument("--total", metavar="X", help="time of both motions of a sequence [s]")
    parser.add_argument(
        "--lock-energy", metavar="X",
        help="also a sequence whose first lock may meet this energy instead of rest [J]",
    )  # fmt: skip
    parser.add_argument("--dwell", metavar="X", help="locked time between them, on top [s]")
    parser.add_argument("--results", type=Path, metavar="DIR", help="a new results folder")
    parser.add_argument("--overwrite", action="store_true", help="replace the results folder")
    parser.add_argument("--no-figures", action="store_true", help="leave the figures out")


def _numbers() -> dict[str, str]:
    from studies.arm.numbers import NUMBERS

    return NUMBERS


def run(options: argparse.Namespace, console: Console) -> ExitCode:
    """Carry out `antenna-ocp arm`."""
    from models.errors import ModelError

    try:
        return _run(options, console)
    except ModelError as error:  # such as a step that diverges
        raise StudyError(str(error), ExitCode.NOT_SOLVED) from error


def _run(options: argparse.Namespace, console: Console) -> ExitCode:
    from studies.arm.config import read
    from studies.arm.modes import check_flags
    from studies.arm.optimal.solve import check_bending

    check_flags(options)
    if options.sequence is not None:
        from studies.arm.questions.sequence.command import run_sequence

        return run_sequence(options, console)
    flags = {name: getattr(options, name) for name in ("stage", "objective", *_numbers())}
    study = read(options.config, flags)
    if study.objective != "time":  # whose duration is not known yet
        check_bending(study.stage)
    if options.baselines is not None:
        return _baselines(options, study, console)
    if options.trade_off:
        return _trade_off(options, study, console)
    if options.least_duration is not None:
        return _least_duration(options, study, console)
    return _one(options, study, console)


def _least_duration(options: argparse.Namespace, study: ArmStudy, console: Console) -> ExitCode:
    """Least durations under one torque cap and one residual."""
    import dataclasses

    from studies.arm.questions.least_duration import least_durations, table, torque_cap
    from studies.common.folder import open_results, provenance

    if len(study.stage.moving) > 1:
        raise StudyError("--least-duration takes a stage that turns one joint; give big or small")
    folder = open_results(options.results, f"arm-{study.stage.name}-least", options.overwrite)
    drive = options.least_duration
    cap = torque_cap(study.stage, drive)
    found = least_durations(study.stage, drive, cap, console.progress)
    printed = table(study.stage, drive, cap, found)
    console.say(printed)
    folder.file("table.txt").write_text(f"{printed}\n", "utf-8")
    folder.write_json("least_durations.json", {
        "study": dict(study.given), "drive": drive, "torque_cap_Nm": cap,
        "rows": [dataclasses.asdict(row) for row in found],
        "made_by": provenance(),
    })  # fmt: skip
    folder.complete()
    others = [row.duration for row in found[1:] if row.duration is not None]
    best = found[0].duration
    ahead = best is not None and all(best <= other for other in others)
    return ExitCode.OK if ahead else ExitCode.NOT_VERIFIED


def _trade_off(options: argparse.Namespace, study: ArmStudy, console: Console) -> ExitCode:
    """Residual energy against duration."""
    from studies.arm.questions.trade_off import between, curves, table
    from studies.arm.report.figures import tradeoff_figure
    from studies.common.folder import open_results, provenance

    folder = open_results(options.results, f"arm-{study.stage.name}-trade-off", options.overwrite)
    found = curves(study.stage, console.progress)
    printed = table(study.stage, found)
    console.say(printed)
    folder.file("table.txt").write_text(f"{printed}\n", "utf-8")
    reduced = between(study.stage)
    folder.write_json("trade_off.json", {
        "study": dict(study.given), "durations_and_energies": found,
        "durations_and_energies_on_B21": reduced, "made_by": provenance(),
    })  # fmt: skip
    if not options.no_figures:
        tradeoff_figure(study.stage, found, reduced).savefig(folder.file("trade_off.png"))
    folder.complete()
    console.say(f"everything is in {folder.path}")
    return ExitCode.OK


def _one(options: argparse.Namespace, study: ArmStudy, console: Console) -> ExitCode:
    """Solve, refine, report, export and draw one motion."""
    import dataclasses

    from studies.arm.optimal.phase import is_slow
    from studies.arm.optimal.solve import check_caps, refine, solve_stage
    from studies.arm.replay.floor import numerical_floor
    from studies.arm.replay.loads import loads
    from studies.arm.report.export import write_input, write_loads, write_profile
    from studies.arm.report.facts import check_mesh, checks, duration_to_try, facts, rounds, table
    from studies.common.folder import open_results, provenance

    if study.objective != "time":
        check_caps(study.stage, study.limits)
    check_mesh(study)
    folder = open_results(options.results, f"arm-{study.stage.name}", options.overwrite)
    write_input(folder, study)
    try:
        solved = solve_stage(
            study.stage, limits=study.limits, objective=study.objective, progress=console.live
        )
    except StudyError as error:
        hint = duration_to_try(study.stage, study.limits)
        raise StudyError(f"{error}{hint}", error.exit_code) from error
    found = refine(solved, study.limits, objective=study.objective, say=console.progress)
    study = dataclasses.replace(study, stage=found.solved.stage)  # least time has its own duration
    full = found.solved.replay(
        "torque", after=_after(study), elements=study.elements, modes=study.modes
    )
    found = dataclasses.replace(found, replay=full)
    history = loads(full)
    write_loads(folder, history, full)
    values = facts(study, found, history)
    again = write_profile(folder, study, full, {"rounds": rounds(found)})
    values["residual energy of the sampled profile [J]"] = again.residual_energy
    printed = table(study, values)
    folder.file("table.txt").write_text(f"{printed}\n", "utf-8")
    console.say(printed)
    if is_slow(study.stage):
        floor = numerical_floor(found.solved.motion("torque"))
        values["numerical floor of the residual energy [J]"] = floor.energy
        console.say(floor)
    verified = checks(study, found, history)
    for sentence, passed in verified:
        console.say(f"{'verified' if passed else 'FAILED'}: {sentence}")
    passed = all(ok for _, ok in verified)
    folder.write_json("verification.json", {
        "passed": passed, "study": dict(study.given),
        "checks": dict(verified), "values": values,
        "rounds": rounds(found), "made_by": provenance(),
    })  # fmt: skip
    if not options.no_figures:
        _draw(folder, [full], study, console, found.solved.reduced)
    folder.complete()
    console.say(f"everything is in {folder.path}; rerun: antenna-ocp arm --config "
                f"{folder.file('input.toml')}")  # fmt: skip
    return ExitCode.OK if passed else ExitCode.NOT_VERIFIED


def _after(study: ArmStudy) -> Array:
    import numpy as np

    T = study.stage.duration
    return np.linspace(T, 1.25 * T, 401)


def _baselines(options: argparse.Namespace, study: ArmStudy, console: Console) -> ExitCode:
    """Set an optimum beside each baseline."""
    from studies.arm.optimal.phase import is_slow
    from studies.arm.questions.baselines import compare, table
    from studies.arm.replay.floor import numerical_floor
    from studies.arm.report.facts import missed
    from studies.arm.report.figures import residual_figure
    from studies.common.folder import open_results, provenance

    stage, drive = study.stage, options.baselines
    folder = open_results(options.results, f"arm-{stage.name}-{drive}", options.overwrite)
    share = None if is_slow(stage) else SHARES[stage.name]
    pairs = compare(stage, drive, share, console.progress, follow=not options.no_figures)
    printed = table(stage, drive, pairs)
    console.say(printed)
    if share is None and pairs[-1].optimum is not None:
        console.say(numerical_floor(pairs[-1].optimum.motion))
    motions = [m for p in pairs for m in (p.baseline, p.optimum) if m is not None]
    short = [] if study.latch is None else missed(motions, study.latch)
    for line in short:
        console.say(line)
    folder.file("table.txt").write_text(f"{printed}\n", "utf-8")
    resolved = all(pair.refined is not None and pair.refined.agrees for pair in pairs)
    holds = all(pair.holds for pair in pairs)
    folder.write_json("verification.json", {
        "passed": holds and resolved and not short, "study": dict(study.given), "drive": drive,
        "limit": share, "missed_latches": short,
        "rows": [_record(pair.baseline, pair.optimum, pair.ratio, pair.holds) for pair in pairs],
        "made_by": provenance(),
    })  # fmt: skip
    if not options.no_figures:
        after = _after(study)
        best = [p.refined.solved.replay(drive, after=after) for p in pairs[-1:] if p.refined]
        _draw(folder, [*best, *(p.baseline for p in pairs)], study, console)
        left = residual_figure([(p.optimum, [p.baseline]) for p in pairs])
        left.savefig(folder.file("residual.png"))
    folder.complete()
    mesh = "" if resolved else ", but not every mesh is resolved"
    every = "every optimum is still" if share is None else "every ratio holds"
    console.say(f"{every if holds else f'NOT {every}'}{mesh}; all is in "
                f"{folder.path}")  # fmt: skip
    return ExitCode.OK if holds and resolved and not short else ExitCode.NOT_VERIFIED


def _record(
    baseline: Replay, optimum: Replay | None, ratio: float, holds: bool
) -> dict[str, object]:
    row: dict[str, object] = {
        "baseline": baseline.motion.name,
        "peak_torque_Nm": baseline.peak_torque.tolist(),
        "residual_energy_J": baseline.residual_energy,
        "modal_amplitude_m": baseline.modal_amplitude.tolist(),
        "angle_miss_rad": baseline.miss,
        "ratio": ratio,
        "holds": holds,
    }
    if optimum is not None:
        row["optimum_peak_torque_Nm"] = optimum.peak_torque.tolist()
        row["optimum_residual_energy_J"] = optimum.residual_energy
        row["optimum_modal_amplitude_m"] = optimum.modal_amplitude.tolist()
    return row


def _draw(
    folder: ResultsFolder, replays: list[Replay], study: ArmStudy, console: Console,
    reduced: ReducedMotion | None = None,
) -> None:  # fmt: skip
    from studies.arm.report.figures import all_figures
    from studies.common.drawing import save

    caps = (None, None) if reduced is None else study.limits.torque
    save(all_figures(replays, reduced, caps), folder, console)
    console.progress(f"figures of the stage '{study.stage.name}' drawn")
