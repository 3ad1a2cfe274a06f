"""The rope-length profile as CSV and JSON, and the input that reproduces a result."""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.common.folder import ResultsFolder, provenance
from studies.truss.config import TrussStudy
from studies.truss.deployment import Deployment

Array = NDArray[np.float64]

SAMPLES = 2001  # evenly spaced rows of a profile; the times of kinks are added
CLOSE = 0.4  # of the spacing: rows closer than this to a kink give way to it

# column: unit. The rope shortens: its speed is negative while it is hauled in.
COLUMNS = {
    "time": "s",
    "rope_length": "m",
    "rope_speed": "m/s",
    "rope_acceleration": "m/s^2",
    "motor_force": "N",
    "far_end_tension": "N",
    "motor_power": "W",
    "angle": "rad",
    "angular_speed": "rad/s",
    "angular_acceleration": "rad/s^2",
    "angular_jerk": "rad/s^3",
    "angular_jerk_before": "rad/s^3",  # its limit from the left; the jerk may jump
    "reaction_force": "N",
    "joint_power": "W",
    "pulley_power": "W",
    "kinetic_energy": "J",
    "potential_energy": "J",
}


def profile(deployment: Deployment, samples: int = SAMPLES) -> dict[str, Array]:
    """All columns of the profile, shape (m,) each; forces are those of one of the two ropes."""
    time = _times(deployment, samples)
    motion, truss = deployment.at(time)
    return {
        "time": time,
        "rope_length": truss.rope_length,
        "rope_speed": truss.rope_speed,
        "rope_acceleration": truss.rope_acceleration,
        "motor_force": truss.rope_force,
        "far_end_tension": truss.far_end_tension,
        "motor_power": truss.motor_power,
        "angle": motion.angle,
        "angular_speed": motion.speed,
        "angular_acceleration": motion.acceleration,
        "angular_jerk": motion.jerk,
        "angular_jerk_before": deployment.law.motion(np.nextafter(time, 0.0)).jerk,
        "reaction_force": truss.reaction_force,
        "joint_power": truss.joint_power,
        "pulley_power": truss.pulley_power,
        "kinetic_energy": truss.kinetic_energy,
        "potential_energy": truss.potential_energy,
    }


def _times(deployment: Deployment, samples: int) -> Array:
    """Times of all kinks, and even ones that are not next to a kink."""
    even, spacing = np.linspace(0.0, deployment.law.duration, samples, retstep=True)
    edges = np.array([t for t in deployment.edges if 0 < t < deployment.law.duration])
    if edges.size:
        nearest = np.abs(even[:, None] - edges).min(axis=1)
        ends = [0, -1]
        keep = nearest > CLOSE * spacing
        keep[ends] = True
        even = even[keep]
    return np.unique(np.concatenate([even, edges]))


def write_profile(
    folder: ResultsFolder, deployment: Deployment, study: TrussStudy, accuracy: Mapping[str, object]
) -> tuple[Path, Path]:
    """Write `profile.csv` (units and provenance in its first lines) and `profile.json`."""
    columns = profile(deployment)
    about = {
        "law": deployment.name,
        "study": as_dictionary(study),
        "accuracy": accuracy,
        "made_by": provenance(),
    }
    csv_path = folder.file("profile.csv")
    with csv_path.open("w", newline="", encoding="utf-8") as file:
        file.writelines(f"# {line}\n" for line in _flat(about))
        writer = csv.writer(file)
        writer.writerow(f"{name} [{COLUMNS[name]}]" for name in columns)
        writer.writerows(_cells(row) for row in zip(*columns.values(), strict=True))
    table = {name: {"unit": COLUMNS[name], "values": v} for name, v in columns.items()}
    json_path = folder.write_json("profile.json", {**about, "columns": table})
    return csv_path, json_path


def _cells(row: tuple[float, ...]) -> list[str]:
    return ["" if value != value else repr(float(value)) for value in row]


def _flat(content: Mapping[str, Any], prefix: str = "") -> list[str]:
    lines: list[str] = []
    for key, value in content.items():
        if isinstance(value, Mapping):
            lines += _flat(value, f"{prefix}{key}.")
        else:
            lines.append(f"{prefix}{key} = {value}")
    return lines


def as_dictionary(study: TrussStudy) -> dict[str, Any]:
    """The nested dictionary from which `study_from` makes the same study again."""
    stages = [
        next(iter(stage)) if list(stage.values()) == [1.0] else dict(stage)
        for stage in study.minimise
    ]
    low, high = study.duration
    caps = {key: v for key, v in dataclasses.asdict(study.caps).items() if v is not None}
    return {
        "minimise": stages[0] if len(stages) == 1 else stages,
        "duration": low if low == high else [low, high],
        "concession": study.concession,
        "smooth": study.smooth,
        "caps": caps,
        "solver": {"intervals": study.solver.intervals, "starts": list(study.solver.starts)},
        "truss": dataclasses.asdict(study.truss),
    }


def write_input(folder: ResultsFolder, study: TrussStudy) -> Path:
    """Write `input.toml`, which `antenna-ocp truss --config` takes to reproduce the result."""
    path = folder.file("input.toml")
    path.write_text(
        "# Reproduces this result: antenna-ocp truss --config input.toml\n\n"
        + "\n".join(_toml(as_dictionary(study)))
        + "\n",
        "utf-8",
    )
    return path


def _toml(content: Mapping[str, Any], table: str = "") -> list[str]:
    """TOML lines of a nested dictionary; weights become inline tables."""
    inline = {"minimise"}
    plain = {k: v for k, v in content.items() if not isinstance(v, Mapping) or k in inline}
    tables = {k: v for k, v in content.items() if k not in plain}
    lines = [f"{key} = {_toml_value(value)}" for key, value in plain.items()]
    for key, value in tables.items():
        name = f"{table}.{key}" if table else key
        lines += ["", f"[{name}]", *_toml(value, name)]
    return lines


def _toml_value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml_value, value)) + "]"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{k} = {_toml_value(v)}" for k, v in value.items()) + " }"
    return repr(value)
