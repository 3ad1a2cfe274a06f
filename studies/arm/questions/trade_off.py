"""Residual energy against duration: the smoothest motion and the smooth laws, torque drive.

The shaped laws are left out: each duration would need the search for a frequency again.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from models.errors import ModelError
from studies.arm.config import as_dictionary
from studies.arm.laws.scan import left_by_laws
from studies.arm.laws.unit_laws import baselines
from studies.arm.optimal.solve import solve_stage
from studies.arm.questions.baselines import replay_law
from studies.arm.report.quantities import Metric, table_rows
from studies.arm.search_limits import SHAPER, TRADE_OFF_RATIOS, TRADE_OFF_REDUCED
from studies.arm.stage import Stage
from studies.arm.trade_off import TradeOffStudy
from studies.common.comparison_table import costs_elsewhere
from studies.common.console import Console
from studies.common.exit_codes import StudyError
from studies.common.folder import provenance
from studies.common.result import Result, Series, Verdict

Say = Callable[[str], None]
Curves = dict[str, tuple[list[float], list[float]]]
"""Durations [s] and residual energies [J], by law."""
OPTIMUM = "optimum"
LAWS = ("linear torque", "quintic", "Step5", "Bezier")


def curves(stage: Stage, say: Say) -> Curves:
    """What the optimum and the laws leave on the full model; a duration that fails is left out."""
    by_law: Curves = {name: ([], []) for name in (OPTIMUM, *LAWS)}
    for ratio in TRADE_OFF_RATIOS:
        shorter = stage.lasting(ratio * stage.duration)
        for name, (durations, energies) in by_law.items():
            say(f"{stage.name} arm, {shorter.duration:.4g} s: {name}")
            try:
                energy = _left(shorter, name)
            except (StudyError, ModelError) as error:
                say(f"{name}, {shorter.duration:.4g} s: {error}")
                continue
            durations.append(shorter.duration)
            energies.append(energy)
    return by_law


def reduced_curves(stage: Stage) -> Curves:
    """The laws' curves on B21, durations close together; nothing where both joints turn."""
    if len(stage.moving) > 1:
        return {}
    first, last = TRADE_OFF_RATIOS[0], TRADE_OFF_RATIOS[-1]
    times = np.linspace(first, last, TRADE_OFF_REDUCED) * stage.duration
    laws = [{x.name: x.law for x in baselines(T, SHAPER / T)} for T in times.tolist()]
    return {
        name: (times.tolist(), left_by_laws(stage, [x[name] for x in laws], "torque").tolist())
        for name in LAWS
    }


def _left(stage: Stage, name: str) -> float:
    """E_res on the full model [J]."""
    if name == OPTIMUM:
        return solve_stage(stage).replay().residual_energy
    laws = {law.name: law for law in baselines(stage.duration, SHAPER / stage.duration)}
    return replay_law(stage, laws[name], "torque").residual_energy


def trade_off(study: TradeOffStudy, console: Console) -> Result:
    """Residual energy against duration, of the smoothest motion and of the smooth laws."""
    stage = study.slew
    full, reduced = curves(stage, console.progress), reduced_curves(stage)

    rows = table_rows({name: _quantities(*curve) for name, curve in full.items()})
    found_all = all(len(times) == len(TRADE_OFF_RATIOS) for times, _ in full.values())

    return Result(
        kind="pareto-arm",
        question=study.question,
        configuration=as_dictionary(study),
        arrays=_series(full, "full model") | _series(reduced, "B21"),
        table=rows,
        verdict=Verdict(
            "measured",
            "measured: each motion replayed on the full ANCF model"
            + ("" if found_all else "; what is not in the table was not found"),
        ),
        costs_elsewhere=costs_elsewhere(rows),
        remarks=("the optimum is the smoothest torque, on its first mesh",),
        details={"stage": {"duration": stage.duration, "start": stage.start, "end": stage.end}},
        provenance=provenance(),
    )


def _quantities(times: list[float], energies: list[float]) -> list[Metric]:
    return [
        Metric(f"residual_energy_{T:.4g}_s", f"residual energy in {T:.4g} s", "J", energy)
        for T, energy in zip(times, energies, strict=True)
    ]


def _series(curves: Curves, model: str) -> dict[str, Series]:
    """A law's durations on a model are the axis of its residual energies."""
    arrays: dict[str, Series] = {}
    for name, (times, energies) in curves.items():
        axis = f"{name}, {model}: duration"
        arrays[axis] = Series("s", axis, np.array(times), "of the motion")
        energy = Series("J", axis, np.array(energies), "residual energy after the lock")
        arrays[f"{name}, {model}: residual energy"] = energy
    return arrays


def read_curves(result: Result, model: str) -> Curves:
    """The curves of a result on a model, "full model" or "B21"."""
    tail = f", {model}: duration"
    names = [name.removesuffix(tail) for name in result.arrays if name.endswith(tail)]
    return {
        name: (
            result.arrays[f"{name}{tail}"].values.tolist(),
            result.arrays[f"{name}, {model}: residual energy"].values.tolist(),
        )
        for name in names
    }
