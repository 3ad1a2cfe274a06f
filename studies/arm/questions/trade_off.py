"""Residual energy against duration: the smoothest motion and the smooth laws, torque drive.

The shaped laws are left out: each duration would need the search for a frequency again.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from models.errors import ModelError
from studies.arm.laws.scan import left_by_laws
from studies.arm.laws.unit_laws import baselines
from studies.arm.optimal.solve import MESH, solve_stage
from studies.arm.questions.baselines import replay_law
from studies.arm.stage import Stage
from studies.common.console import Table, number
from studies.common.exit_codes import StudyError

Say = Callable[[str], None]
Curves = dict[str, tuple[list[float], list[float]]]
OPTIMUM = "optimum"
LAWS = ("linear torque", "quintic", "Step5", "Bezier")
RATIOS = (0.7, 0.85, 1.0, 1.2, 1.5)  # of the stage's duration
BETWEEN = 161  # durations on B21


def curves(stage: Stage, say: Say) -> Curves:
    """Durations [s] and residual energies on the full model [J], by law."""
    found: Curves = {name: ([], []) for name in (OPTIMUM, *LAWS)}
    for ratio in RATIOS:
        at = stage.lasting(ratio * stage.duration)
        for name in found:
            say(f"{stage.name} arm, {at.duration:.4g} s: {name}")
            try:
                energy = _left(at, name)
            except (StudyError, ModelError) as error:
                say(f"{name}, {at.duration:.4g} s: {error}")
                continue
            found[name][0].append(at.duration)
            found[name][1].append(energy)
    return found


def between(stage: Stage) -> Curves:
    """The laws' curves on B21, durations close together; nothing where both joints turn."""
    if len(stage.moving) > 1:
        return {}
    times = np.linspace(RATIOS[0], RATIOS[-1], BETWEEN) * stage.duration
    laws = [{x.name: x.law for x in baselines(T, 10.0 / T)} for T in times.tolist()]
    return {
        name: (times.tolist(), left_by_laws(stage, [x[name] for x in laws], "torque").tolist())
        for name in LAWS
    }


def _left(stage: Stage, name: str) -> float:
    if name == OPTIMUM:
        return solve_stage(stage).replay().residual_energy
    laws = baselines(stage.duration, 10.0 / stage.duration)
    return replay_law(stage, next(x for x in laws if x.name == name), "torque").residual_energy


def table(stage: Stage, found: Curves) -> Table:
    """The curves as a table."""
    durations = sorted({t for times, _ in found.values() for t in times})
    rows = []
    for name, (times, left) in found.items():
        known = dict(zip(times, left, strict=True))
        rows.append((name, *(number(known.get(t), 3) for t in durations)))
    head = ("law", *(f"{t:.4g} s" for t in durations))
    return Table(
        f"{stage.name} arm, torque drive: residual energy [J] on the full model", head, rows,
        (f"the optimum is the smoothest torque, on a mesh of {MESH} intervals",),
    )  # fmt: skip
