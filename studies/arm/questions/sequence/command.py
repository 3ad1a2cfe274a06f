"""`antenna-ocp arm --sequence`: big arm, locked dwell and small arm as one problem."""

from __future__ import annotations

import argparse
import csv
import dataclasses

import numpy as np
from matplotlib.figure import Figure

from studies.arm.config import read
from studies.arm.numbers import ARM
from studies.arm.questions.sequence.problem import SMOOTHING, Least, Sequence, sequence
from studies.arm.questions.sequence.solve import (
    SequenceReplay,
    SolvedSequence,
    alone,
    replay_sequence,
    solve_sequence,
)
from studies.arm.questions.sequence.variants import smoothing_share, without_rest
from studies.common.console import Console, Table, number
from studies.common.drawing import COLOURS, label_axes, legend_below
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.folder import ResultsFolder, open_results, provenance

TOTAL, DWELL = 198.0, 10.0  # [s], the paper's 86 and 112 s; the dwell is ours
AGREE = 0.2  # share of the full model's energy by which B21 may differ
STILL = 1e-8  # [J] below which both count as still
PAPER = (86.0, 112.0)  # [s]


def run_sequence(options: argparse.Namespace, console: Console) -> ExitCode:
    """Solve, replay, report and write one sequence."""
    arm = read(options.config, {name: getattr(options, name) for name in ARM}).stage.arm
    total, dwell = _time(options.total, "--total", TOTAL), _time(options.dwell, "--dwell", DWELL)
    case = sequence(total, dwell, arm)
    left = None
    if options.lock_energy is not None:
        left = _time(options.lock_energy, "--lock-energy", 0.0)
    every = _time(options.sample_time, "--sample-time", 0.1)
    least, cap = options.sequence, None
    if least == "time":
        if options.torque_cap is None:
            raise StudyError("the least time of a sequence needs --torque-cap; give one in N m")
        cap = _time(options.torque_cap, "--torque-cap", 0.0)
        case = paced(case, cap)
    folder = open_results(options.results, f"arm-sequence-{least}", options.overwrite)
    solved = solve_sequence(case, least, cap, progress=console.live)
    console.progress("solved; replaying on B21 and on the full model")
    replayed = replay_sequence(solved)
    values = facts(solved, replayed)
    values |= _beside(solved, cap, left, console)
    passed = {
        "the replays on B21 and on the full model agree in residual energy": agree(replayed),
        "the torque is within its cap between the points":
            cap is None or max(solved.peaks) <= cap * (1 + 1e-3),
    }  # fmt: skip
    printed = Table(
        f"big arm, {case.dwell:g} s locked, small arm: least {least.replace('-', ' ')}, "
        "rest at each lock", ("quantity", "value"),
        [(name, number(float(value), 6)) for name, value in values.items()],
        (f"both arms' smoothness counts {SMOOTHING:g} beside the objective; the total is that of "
         "both motions, the dwell on top",),
    )  # fmt: skip
    console.say(printed)
    for sentence, held in passed.items():
        console.say(f"{'verified' if held else 'FAILED'}: {sentence}")
    folder.file("table.txt").write_text(f"{printed}\n", "utf-8")
    folder.write_json("verification.json", {
        "passed": all(passed.values()), "checks": passed, "values": values,
        "study": {"sequence": least, "total": case.moving_time, "dwell": case.dwell,
                  "torque_cap": cap, "arm": dataclasses.asdict(arm)}, "made_by": provenance(),
    })  # fmt: skip
    write_torques(folder, solved, every)
    if not options.no_figures:
        torque_figure(solved).savefig(folder.file("fig10_torques.png"))
    folder.complete()
    console.say(f"everything is in {folder.path}")
    return ExitCode.OK if all(passed.values()) else ExitCode.NOT_VERIFIED


def _beside(
    solved: SolvedSequence, cap: float | None, left: float | None, console: Console
) -> dict[str, float]:
    """What rest and smoothness cost; what was not found is said and left out."""
    least: Least = "peak-torque" if cap is None else "time"
    parts = [
        (lambda: sums(solved, cap, console)) if cap is not None
        else (lambda: smoothing_share(solved, console.live))
    ]  # fmt: skip
    if left is not None:
        parts.append(lambda: without_rest(solved, least, cap, left, console.live))
    values: dict[str, float] = {}
    for part in parts:
        try:
            values |= part()
        except StudyError as error:
            console.say(f"left out: {error}")
    return values


def _time(given: float | str | None, flag: str, default: float) -> float:
    try:
        found = default if given is None else float(given)
    except (TypeError, ValueError):
        found = float("nan")
    if not (np.isfinite(found) and found > 0):
        raise StudyError(f"{flag} is {given}; give a number above zero")
    return found


def paced(case: Sequence, cap: float) -> Sequence:
    """The sequence at the pace of a cap, a tenth above the rigid bound."""
    total = case.moving_time * float(np.sqrt(1.1 * case.rigid_bound / cap))
    return sequence(total, case.dwell, case.first.arm)


def agree(replayed: SequenceReplay) -> bool:
    """Whether both models leave the same energy, or next to none."""
    full, reduced = replayed.at_end, replayed.reduced[1]
    return max(full, reduced) <= STILL or abs(full - reduced) <= AGREE * full


def facts(solved: SolvedSequence, replayed: SequenceReplay) -> dict[str, float]:
    """All figures, with units in their names."""
    case, (t1, pause, t3) = solved.case, solved.durations
    bound = case.rigid_bound * (case.moving_time / (t1 + t3)) ** 2
    paper = max(
        4.0 * inertia / T**2 for inertia, T in zip(
            (case.first.inertias[0] * np.pi / 2, case.second.inertias[1] * np.pi), PAPER,
            strict=True,
        )
    )  # fmt: skip
    return {
        "big arm [s]": t1, "dwell [s]": pause, "small arm [s]": t3, "both motions [s]": t1 + t3,
        "peak torque, root [N m]": solved.peaks[0], "peak torque, elbow [N m]": solved.peaks[1],
        "rigid bound of this time, best split [N m]": bound,
        "surcharge over the rigid bound [%]": 100 * (max(solved.peaks) / bound - 1),
        "rigid bound of the paper's 86 and 112 s [N m]": paper,
        "energy after the first lock, full model [J]": replayed.at_lock,
        "energy after the first lock, B21 [J]": replayed.reduced[0],
        "energy after the last lock, full model [J]": replayed.at_end,
        "energy after the last lock, B21 [J]": replayed.reduced[1],
        "kinetic energy lost in the first lock [J]": replayed.first.engagement.lost_energy,
        "impulse of the first lock at the root [N m s]":
            float(replayed.first.engagement.impulse[0]),
        "angle miss, root [rad]": abs(replayed.first.engagement.miss[0]),
        "angle miss, elbow [rad]": abs(replayed.second.engagement.miss[1]),
    }  # fmt: skip


def sums(solved: SolvedSequence, cap: float, console: Console) -> dict[str, float]:
    """Least durations of the stages solved alone, beside the sequence."""
    first, second = alone(solved.case, cap, console.live)
    together = solved.durations[0] + solved.durations[2]
    return {
        "big arm alone [s]": first, "small arm alone [s]": second,
        "sum of both alone [s]": first + second,
        "sequence less the sum [s]": together - first - second,
    }  # fmt: skip


def write_torques(folder: ResultsFolder, solved: SolvedSequence, every: float) -> None:
    """Write `profile.csv`: both torques at a sample time, from the start of the big arm."""
    root, elbow = solved.torques
    ends = np.cumsum(solved.durations)
    t = np.linspace(0.0, ends[2], max(2, round(ends[2] / every) + 1))
    columns = np.column_stack([
        t, np.where(t <= ends[0], root(np.clip(t, 0, ends[0])), 0.0),
        np.where(t >= ends[1], elbow(np.clip(t - ends[1], 0, elbow.x[-1])), 0.0),
    ])  # fmt: skip
    with folder.file("profile.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["time [s]", "root_torque [N m]", "elbow_torque [N m]"])
        writer.writerows(columns.tolist())


def torque_figure(solved: SolvedSequence) -> Figure:
    """Both torques over time, with the rigid bound and the locks."""
    figure = Figure(figsize=(7.2, 4.0), dpi=150, layout="constrained")
    panel = figure.subplots()
    ends = np.cumsum(solved.durations)
    for law, start, colour, name in (
        (solved.torques[0], 0.0, COLOURS[0], "root"),
        (solved.torques[1], ends[1], COLOURS[1], "elbow"),
    ):  # fmt: skip
        t = np.linspace(0.0, law.x[-1], 4001)
        panel.plot(start + t, law(t), color=colour, label=f"{name} torque")
    case = solved.case
    bound = case.rigid_bound * (case.moving_time / (ends[0] + ends[2] - ends[1])) ** 2
    for sign in (-1, 1):
        panel.axhline(sign * bound, color="0.6", lw=0.8, ls="--",
                      label="rigid bound" if sign > 0 else None)  # fmt: skip
    for end in ends[[0, 2]]:
        panel.axvline(end, color="0.5", lw=0.8, ls=":")
    panel.set_title("Big arm, locked dwell, small arm: joint torques, locks dotted", fontsize=12)
    label_axes(panel, "time [s]", "torque [N m]")
    legend_below(figure, panel)
    return figure
