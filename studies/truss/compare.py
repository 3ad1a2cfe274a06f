"""The table of the optimal law beside the paper's laws and the bounds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from models.laws import PAPER_POINTS, Bezier, Step5, pinned
from models.truss import TrussParameters
from studies.common.console import Table, number
from studies.truss.config import DEPLOYED, TrussStudy
from studies.truss.deployment import Deployment
from studies.truss.quantities import QUANTITIES

CAP_TOLERANCE = 1e-6  # relative; what an optimiser that rides a cap leaves
ROWS = (
    "time",
    "peak-speed",
    "peak-acceleration",
    "peak-jerk",
    "peak-rope-acceleration",
    "peak-force",
    "least-tension",
    "peak-power",
    "energy",
    "peak-reaction",
)


def paper_laws(truss: TrussParameters, duration: float) -> tuple[Deployment, Deployment]:
    """The paper's Bezier law, its ends pinned to the exact angles, and its Step5."""
    points = pinned(PAPER_POINTS, truss.stowed_angle, DEPLOYED)
    return (
        Deployment("Bezier", Bezier(duration, points), truss),
        Deployment("Step5", Step5(duration, truss.stowed_angle, DEPLOYED), truss),
    )


def cap_of(study: TrussStudy, key: str) -> float | None:
    """The cap that the quantity `key` has to keep, if there is one."""
    caps = {
        "peak-speed": study.caps.speed,
        "peak-acceleration": study.caps.acceleration,
        "peak-jerk": study.caps.jerk,
        "peak-force": study.caps.force,
        "least-tension": study.caps.least_tension,
    }
    return caps.get(key)


def broken_caps(study: TrussStudy, values: Mapping[str, float]) -> dict[str, float]:
    """Caps that these values break, and by how much, relative."""
    excess = {}
    for key in ROWS:
        cap = cap_of(study, key)
        value = values[key]
        if cap is None or math.isnan(value):
            continue
        # a tension is a small share of the motor's force, and accurate to a share of it
        size = values["peak-force"] if key == "least-tension" else cap
        miss = (cap - value if key == "least-tension" else value - cap) / size
        if miss > CAP_TOLERANCE:
            excess[key] = miss
    return excess


def comparison(
    study: TrussStudy, deployments: Sequence[Deployment], bounds: Mapping[str, float]
) -> Table:
    """Table of all quantities of the deployments, with caps and bounds; broken caps are marked."""
    broken = [broken_caps(study, deployment.values) for deployment in deployments]
    rows = []
    for key in ROWS:
        cells = [
            number(deployment.values[key], 6) + (" !" if key in excess else "  ")
            for deployment, excess in zip(deployments, broken, strict=True)
        ]
        title = f"{QUANTITIES[key].title} [{QUANTITIES[key].unit}]"
        mark = "* " if key in study.objectives else "  "
        rows.append([mark + title, *cells, number(cap_of(study, key)), number(bounds.get(key), 6)])
    head = ["", *(f"{deployment.name}  " for deployment in deployments), "cap", "bound"]
    notes = ["* minimised.  bound: no motion is better, each row on its own."]
    if any(broken):
        notes.append("! breaks a cap, so the law is no candidate.")
    return Table(title=describe(study), head=head, rows=rows, notes=notes)


def describe(study: TrussStudy) -> str:
    """The study in one line."""
    low, high = study.duration
    time = f"T = {low:g} s" if low == high else f"T from {low:g} to {high:g} s"
    aims = ", then ".join(" + ".join(_term(*item) for item in s.items()) for s in study.minimise)
    return (
        f"Ring truss, {study.truss.modules} modules, mu = {study.truss.pulley_friction:g}, {time}: "
        f"least {aims}"
    )


def _term(name: str, weight: float) -> str:
    return name if weight == 1 else f"{weight:g} {name}"
