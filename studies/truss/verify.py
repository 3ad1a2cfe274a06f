"""Checks of a deployment against its study, independent of how it was found.

The law is evaluated between its points, driven through the truss model, and held against the
end conditions (45), the caps and the energy balance.
"""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from models.errors import ModelError
from models.laws import Law, Piecewise, Tabulated, linear_jerk
from models.truss import angle_from_rope_length
from studies.common.exit_codes import StudyError
from studies.truss.checks import check_speed_sense
from studies.truss.compare import broken_caps, cap_of
from studies.truss.config import DEPLOYED, TrussStudy
from studies.truss.deployment import Deployment
from studies.truss.quantities import QUANTITIES

Array = NDArray[np.float64]

ANGLE_MISS = 1e-8  # [rad] of a computed law at the end; a profile's own digits may be fewer
PROFILE_MISS = 1e-4  # [rad], 0.006 deg: what a profile of four to five digits leaves
REST = 1e-6  # of the peak speed or acceleration: what counts as none at an end
IMBALANCE = 1e-8  # of the motor's work: far above the quadrature's own error of 1e-14
EXACT = 1e-9  # [rad]: jerks that integrate to the angles this closely are the law's own
JERKS = {"angular_jerk", "angular_jerk_before"}
LEAST_POINTS = 20


@dataclass(frozen=True)
class Check:
    """One thing that was checked.

    Attributes
    ----------
    name, unit : what.
    value, limit : found, and the most (or for a tension least) that passes.
    passed : whether it did.
    """

    name: str
    unit: str
    value: float
    limit: float
    passed: bool

    @property
    def sentence(self) -> str:
        """One line for the report."""
        verdict = "passed" if self.passed else "FAILED"
        return f"{verdict}: {self.name} {self.value:.9g} {self.unit} (limit {self.limit:.9g})"


def checks(
    study: TrussStudy, deployment: Deployment, angle_miss: float = ANGLE_MISS
) -> tuple[Check, ...]:
    """All checks of a deployment."""
    return (
        *_end_checks(study, deployment, angle_miss),
        *_cap_checks(study, deployment),
        _at_most("energy imbalance", "1", deployment.energies.imbalance, IMBALANCE),
    )


def _at_most(name: str, unit: str, value: float, limit: float) -> Check:
    return Check(name, unit, float(value), float(limit), bool(value <= limit))


def _end_checks(study: TrussStudy, deployment: Deployment, angle_miss: float) -> list[Check]:
    ends = deployment.law.motion(np.array([0.0, deployment.law.duration]))
    goals = np.array([study.truss.stowed_angle, DEPLOYED])
    low, high = study.duration
    duration = deployment.law.duration
    rest = REST * deployment.values["peak-speed"]
    found = [
        _at_most("miss of the stowed angle", "rad", abs(ends.angle - goals)[0], angle_miss),
        _at_most("miss of the deployed angle", "rad", abs(ends.angle - goals)[1], angle_miss),
        _at_most("speed at the ends", "rad/s", np.abs(ends.speed).max(), rest),
        _at_most("duration", "s", duration, high * (1 + 1e-9)),
    ]
    if low > 0 and duration < low * (1 - 1e-9):
        found.append(Check("duration (least)", "s", duration, low, False))
    if study.caps.jerk is not None:  # without a cap on jerk, zero acceleration means nothing
        still = REST * deployment.values["peak-acceleration"]
        worst = np.abs(ends.acceleration).max()
        found.append(_at_most("acceleration at the ends", "rad/s^2", worst, still))
    return found


def _cap_checks(study: TrussStudy, deployment: Deployment) -> list[Check]:
    broken = broken_caps(study, deployment.values)
    return [
        Check(
            QUANTITIES[key].title, QUANTITIES[key].unit, deployment.values[key], cap,
            key not in broken,
        )
        for key in QUANTITIES
        if (cap := cap_of(study, key)) is not None
    ]  # fmt: skip


def record(found: tuple[Check, ...]) -> dict[str, Any]:
    """The checks as they are written to a record."""
    return {
        "passed": all(check.passed for check in found),
        "checks": [dataclasses.asdict(check) for check in found],
    }


def read_profile(path: Path, study: TrussStudy) -> Deployment:
    """Read a user's profile and turn it into a deployment.

    The file is CSV (comment lines start with #; a header names the columns) or the JSON of
    `antenna-ocp`. It needs the column `time` and one of `angle`, `angle_deg`, `rope_length`, in
    s, rad, degrees and m; units in brackets after a name are ignored, as are other columns.

    Raises
    ------
    StudyError
        If the file cannot be read or its columns make no motion.
    """
    columns = _read_columns(path)
    for needed in (("time",), ("angle", "angle_deg", "rope_length")):
        if not set(needed) & set(columns):
            raise StudyError(
                f"the profile {path} has no column {' or '.join(needed)}, only "
                f"{', '.join(columns) or 'none'}; name its columns in the first row"
            )
    try:
        angles = _angles(columns, study)
        law: Law = _exact_law(columns, angles) or Tabulated(tuple(columns["time"]), tuple(angles))
    except ModelError as error:
        raise StudyError(f"the profile {path} is no motion: {error}") from error
    points = len(columns["time"])
    if points < LEAST_POINTS:
        raise StudyError(
            f"the profile {path} has {points} points; give at least {LEAST_POINTS}, so "
            "that the motion between them is known"
        )
    speed = law.motion(np.linspace(0, law.duration, 20 * points)).speed
    check_speed_sense(study, (float(speed.min()), float(speed.max())))
    return Deployment(path.stem, law, study.truss)


def _exact_law(columns: dict[str, Array], angles: Array) -> Piecewise | None:
    """The law of piecewise linear jerk, if the file's columns of jerks reproduce the angles."""
    after, before = columns.get("angular_jerk"), columns.get("angular_jerk_before")
    if after is None or before is None or not np.isfinite([after, before]).all():
        return None
    ramps = tuple(zip(after[:-1].tolist(), before[1:].tolist(), strict=True))
    law = linear_jerk(tuple(columns["time"].tolist()), ramps, start_angle=float(angles[0]))
    miss = np.abs(law.motion(columns["time"]).angle - angles).max()
    return law if miss <= EXACT else None


def _angles(columns: dict[str, Array], study: TrussStudy) -> Array:
    if "angle" in columns:
        return columns["angle"]
    if "angle_deg" in columns:
        return np.radians(columns["angle_deg"])
    return angle_from_rope_length(study.truss, columns["rope_length"])


def _read_columns(path: Path) -> dict[str, Array]:
    try:
        text = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise StudyError(f"the profile {path} cannot be read ({reason})") from error
    try:
        return _from_json(text) if path.suffix == ".json" else _from_csv(text)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise StudyError(
            f"the profile {path} cannot be understood ({error}); give CSV with a header like "
            "'time,angle' and one number a cell"
        ) from error


def _from_json(text: str) -> dict[str, Array]:
    columns = json.loads(text)["columns"]
    return {name: _numbers(column["values"]) for name, column in columns.items()}


def _from_csv(text: str) -> dict[str, Array]:
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    header, *rows = csv.reader(io.StringIO("\n".join(lines)))
    names = [name.split("[")[0].strip() for name in header]
    wanted = {"time", "angle", "angle_deg", "rope_length"} | JERKS
    cells = list(zip(*rows, strict=True))
    return {
        name: _numbers(column) for name, column in zip(names, cells, strict=True) if name in wanted
    }


def _numbers(values: Any) -> Array:
    return np.array([np.nan if value in ("", None) else float(value) for value in values])
