"""From the rows of all sections to one result."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from studies.common.comparison_table import TableRow
from studies.common.configuration import as_stated
from studies.common.console import Console, at_work
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series, Verdict
from studies.paper.cases import Cases
from studies.paper.config import PaperStudy
from studies.paper.entries import Entry, PaperVerdict
from studies.paper.sections.arms import arm_entries
from studies.paper.sections.dynamics import dynamics_entries
from studies.paper.sections.flexible_model import flexible_entries
from studies.paper.sections.planning import planning_entries
from studies.paper.sections.truss_model import truss_entries

OURS, PRINTED = "ours", "printed"
SAMPLES = 1401  # even instants of the deployment's curves

# sections of the paper, in its order
SECTIONS: Mapping[str, Callable[[Cases], list[Entry]]] = {
    "III, flexible arm": flexible_entries,
    "IV, ring truss": truss_entries,
    "V-A, planning": planning_entries,
    "V-B, arm": arm_entries,
    "V-C, truss": dynamics_entries,
}


def run(
    study: PaperStudy | None = None,
    console: Console | None = None,
    *,
    kept: FinishedSteps = NOTHING_KEPT,
) -> Result:
    """Recompute the paper.

    Parameters
    ----------
    study : PaperStudy, optional
        With the defaults unless it is given.
    console : Console, optional
        Where lines of progress go: standard error by default. `silent()` shows none.
    kept : FinishedSteps, optional
        Where simulations go to, and where those of an earlier run are read.

    Returns
    -------
    Result
        Of the kind "paper": a row of the table and a check for each number, formula and curve,
        and in `details["entries"]` each with its place, verdict and reason.
    """
    study = study or PaperStudy()
    with at_work(console) as told:
        cases = Cases(study, told, kept)
        return result_of(study, entries_of(cases), cases)


def entries_of(cases: Cases) -> list[Entry]:
    """All rows, in the order of the paper."""
    found: list[Entry] = []
    for section, make in SECTIONS.items():
        cases.console.progress(f"section {section}")
        found += make(cases)
    return found


def result_of(study: PaperStudy, entries: Sequence[Entry], cases: Cases) -> Result:
    """The result that rows make."""
    counts = Counter(entry.verdict for entry in entries)
    said = "; ".join(f"{counts[verdict]} {verdict.value}" for verdict in PaperVerdict)
    failed = sum(not entry.holds for entry in entries)
    missed = f"; {failed} of them not found" if failed else ""
    keys = unique_keys(entries)

    return Result(
        kind="paper",
        question=study.question,
        configuration=as_stated(study),
        arrays={**_deployment_series(cases), **_flexible_series(cases)},
        table=tuple(_table_row(key, entry) for key, entry in zip(keys, entries, strict=True)),
        verdict=Verdict("measured", f"{len(entries)} rows: {said}{missed}"),
        checks=tuple(_criterion(entry) for entry in entries),
        details={
            "entries": [
                {"key": key, **dataclasses.asdict(entry), "verdict": entry.verdict.value}
                for key, entry in zip(keys, entries, strict=True)
            ],
            "counts": {verdict.value: counts[verdict] for verdict in PaperVerdict},
            "profile_of": "Bezier, kinematic set and dynamic set",
        },
        provenance=provenance(),
    )


def unique_keys(entries: Sequence[Entry]) -> list[str]:
    """Keys of rows; one that comes again is numbered."""
    seen: Counter[str] = Counter()
    keys = []
    for entry in entries:
        seen[entry.key] += 1
        keys.append(entry.key if seen[entry.key] == 1 else f"{entry.key}-{seen[entry.key]}")
    return keys


def _table_row(key: str, entry: Entry) -> TableRow:
    values = {OURS: float(entry.ours), PRINTED: entry.printed_value}
    return TableRow(
        key, f"{entry.place} {entry.quantity} ({entry.verdict_text})", entry.unit, values
    )


def _criterion(entry: Entry) -> Criterion:
    reason = f" ({entry.reason})" if entry.reason else ""
    printed = f", printed {entry.printed}" if entry.printed else ""
    sentence = (
        f"{entry.verdict_text}: {entry.place} {entry.quantity}: ours {entry.ours:.6g} {entry.unit}"
        f"{printed}{reason}"
    )
    name = f"{entry.place} {entry.quantity}"
    return Criterion(
        name, entry.unit, float(entry.ours), entry.printed_value, entry.holds, sentence
    )


def _deployment_series(cases: Cases) -> dict[str, Series]:
    """Curves of Figs 11, 12 and 19 along the time of the deployment."""
    t = np.linspace(0.0, cases.study.duration, SAMPLES)
    series = {"time": Series("s", "time", t, "since the start of the deployment")}
    for deployment in cases.kinematic:
        law = deployment.name.lower()
        motion, truss = deployment.at(t)
        for name, unit, values, meaning in (
            ("angle", "rad", motion.angle, "deployment angle"),
            ("speed", "rad/s", motion.speed, "angular speed"),
            ("acceleration", "rad/s^2", motion.acceleration, "angular acceleration"),
            ("rope_length", "m", truss.rope_length, "length of one rope, kinematic set"),
            ("rope_speed", "m/s", truss.rope_speed, "its rate"),
            ("rope_acceleration", "m/s^2", truss.rope_acceleration, "the rate of that"),
        ):
            series[f"{name}_{law}"] = Series(unit, "time", values, f"{meaning}, {deployment.name}")
    for deployment in (cases.dynamic[0], cases.rubbing[0]):
        mu = deployment.truss.pulley_friction
        name = f"motor_force_mu_{mu:g}"
        meaning = f"force of the motor on one rope, Bezier, dynamic set, mu = {mu:g}"
        series[name] = Series("N", "time", deployment.at(t)[1].rope_force, meaning)
    return series


def _flexible_series(cases: Cases) -> dict[str, Series]:
    """Curves of Figs 6, 10, 15 and 16, each along its own time."""
    series: dict[str, Series] = {}
    for name, pendulums in cases.pendulums.items():
        axis = f"{name}_time"
        series[axis] = Series("s", axis, pendulums[0].times, f"{name} pendulum")
        for pendulum in pendulums:
            elements = pendulum.chain.elements
            height = pendulum.position(len(pendulum.chain.links) - 1)[1]
            meaning = f"height of its tip, {elements} elements a link"
            series[f"{name}_y_{elements}"] = Series("m", axis, height, meaning)

    for name, (stage, locked) in cases.arms.items():
        assert locked.after is not None  # asked for
        joint, axis = stage.moving[0], f"{name}_arm_time"
        runs = (locked.before, locked.after)
        times = np.concatenate([run.times for run in runs])
        series[axis] = Series("s", axis, times, f"{name} arm; its lock is at {stage.duration:g} s")
        torque = np.concatenate([locked.before.torque[joint], 0.0 * locked.after.times])
        series[f"{name}_arm_torque"] = Series("N m", axis, torque, "torque of the driven joint")
        for point, link in (("elbow", 0), ("tip", 1)):
            place = np.concatenate([run.position(link) for run in runs], axis=1)
            slots = list(locked.before.chain.slots(link, -1)[:2])
            speed = np.concatenate([run.v[slots] for run in runs], axis=1)
            for k, direction in enumerate("xy"):
                label = f"{name}_arm_{point}_{direction}"
                series[label] = Series("m", axis, place[k], f"{direction} of the {point}")
                meaning = f"speed of the {point} along {direction}"
                series[f"{label}_speed"] = Series("m/s", axis, speed[k], meaning)
    return series
