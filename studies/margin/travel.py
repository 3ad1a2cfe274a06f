"""Available over required force along a motion: margins, the case that governs, and where.

A margin is the available force over the required one, less one, at any place of the travel. At
rest the required force is what holds the truss there against all that resists a standstill. In
motion it is all of it, inertia and friction included. Derating lowers what is available.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from models.truss import Opening, TrussParameters, rope_length, rope_speed, whole_opening
from models.truss.measured import MOST_ROWS, thinning_error
from ocp.arrays import Array, Integers
from studies.common.result import Criterion, Series
from studies.drive.motor import motor_speed
from studies.drive.schema import Drive
from studies.margin.available import available_forces
from studies.margin.loads import (
    AT_REST,
    CONTRIBUTIONS,
    contributions,
    needed_of_the_motor,
    of_the_rotor,
    required_forces,
    with_pulleys,
)
from studies.margin.resistance import check_covers
from studies.margin.schema import LoadCase, MarginRequirements

KINDS = ("static", "dynamic")
TOLERANCE = 1e-6  # of the force, as of a cap: what a solver leaves of a motion that rides a margin
WORDS = {name: name.replace("_", " ") for name in CONTRIBUTIONS}


@dataclass(frozen=True, eq=False)
class CaseAlongTheTravel:
    """One load case along a motion.

    Attributes
    ----------
    case : LoadCase
    required : factored force on each rope by kind, "static" and "dynamic", (m,) each [N].
    margins : by kind, (m,); empty where nothing is said of the available force.
    needed : by kind, what the motor must be able to pull (m,) [N].
    parts : factored contributions by name (m,) [N], pulley friction that of the motion.
    """

    case: LoadCase
    required: Mapping[str, Array]
    margins: Mapping[str, Array]
    needed: Mapping[str, Array]
    parts: Mapping[str, Array]

    def by_margin(self, kind: str) -> Integers:
        """Indices of the instants (m,), least margin first, or where the motor needs most."""
        return np.argsort(self.margins.get(kind, -self.needed[kind]), kind="stable")


@dataclass(frozen=True, eq=False)
class Travel:
    """All load cases along a motion.

    Attributes
    ----------
    margin : MarginRequirements
    time, angle : (m,) [s], [rad].
    available : of the motor for each rope before derating (m,) [N]; None where nothing is said.
    cases : in the order in which they are stated.
    """

    margin: MarginRequirements
    time: Array
    angle: Array
    available: Array | None
    cases: tuple[CaseAlongTheTravel, ...]

    def needed(self) -> Array:
        """What the motor must be able to pull, the worst of all cases and kinds (m,) [N]."""
        return np.max([row for case in self.cases for row in case.needed.values()], axis=0)

    def worst(self, kind: str) -> tuple[CaseAlongTheTravel, int]:
        """The governing case of a kind of margin, and its index along the travel."""
        case = max(self.cases, key=lambda one: float(one.needed[kind].max()))
        if self.available is not None:
            case = min(self.cases, key=lambda one: float(one.margins[kind].min()))
        return case, int(case.by_margin(kind)[0])


def along(
    margin: MarginRequirements,
    truss: TrussParameters,
    drive: Drive | None,
    time: Array,
    motion: tuple[Array, Array, Array],
    opening: Opening | None = None,
) -> Travel:
    """The margins along a motion.

    Parameters
    ----------
    time : (m,) [s].
    motion : angle, speed and acceleration (m,) each [rad, rad/s, rad/s^2].

    Raises
    ------
    StudyError
        If a measured curve does not cover the travel, by default all of the opening.
    """
    angle, speed, acceleration = motion
    if margin.resistance is not None:
        ends = opening or whole_opening(truss)
        check_covers(margin.resistance, ends.start, ends.end, "margin.resistance")
    available = _available(margin, truss, drive, angle, speed)
    wanted = dict(zip(KINDS, margin.required, strict=True))

    found = []
    for number, case in enumerate(margin.load_cases(truss)):
        rows = _kernel(margin, truss, drive, number)(
            *(row[None] for row in (angle, speed, acceleration))
        )
        values = [row.full().ravel() for row in rows]
        required = dict(zip(KINDS, values, strict=False))
        parts = dict(zip(CONTRIBUTIONS, values[len(KINDS) :], strict=True))
        whole = case.derating.whole
        margins = {}
        if available is not None:
            for kind in KINDS:
                ratio = np.full_like(available, np.inf)  # where nothing is required
                where = required[kind] > 0.0
                margins[kind] = (
                    np.divide(available * whole, required[kind], ratio, where=where) - 1.0
                )
        needed = {kind: (1 + wanted[kind]) * required[kind] / whole for kind in KINDS}
        found.append(CaseAlongTheTravel(case, required, margins, needed, parts))
    return Travel(margin, time, angle, available, tuple(found))


@functools.lru_cache(maxsize=32)
def _kernel(
    margin: MarginRequirements, truss: TrussParameters, drive: Drive | None, number: int
) -> ca.Function:
    """Static and dynamic force, then all contributions, of one load case."""
    case = margin.load_cases(truss)[number]
    symbols = alpha, *_ = ca.SX.sym("alpha"), ca.SX.sym("omega"), ca.SX.sym("acc")
    forces = required_forces(margin, case, symbols, drive=drive)
    (static,), dynamic = forces["static"], functools.reduce(ca.fmax, forces["dynamic"])
    parts = contributions(margin, case, symbols)
    # inertia that helps is not multiplied
    parts["inertia"] = ca.fmax(parts["inertia"], parts["inertia"] / case.factors.inertia)
    before = functools.reduce(lambda a, b: a + b, parts.values())
    parts["pulley_friction"] = with_pulleys(case, before, alpha) - before
    rotor = of_the_rotor(drive, case.truss, symbols)
    parts["rotor"] = ca.fmax(rotor, case.factors.rotor * rotor)
    outputs = [static, dynamic, *(parts[name] + 0 * alpha for name in CONTRIBUTIONS)]
    return ca.Function("loads", symbols, outputs, {"cse": True})


@functools.lru_cache(maxsize=8)
def need_kernel(
    margin: MarginRequirements,
    truss: TrussParameters,
    drive: Drive | None = None,
    opening: Opening | None = None,
) -> ca.Function:
    """Angle, speed and acceleration to what the motor must be able to pull; the largest counts."""
    symbols = ca.SX.sym("alpha"), ca.SX.sym("omega"), ca.SX.sym("acc")
    needs = needed_of_the_motor(margin, truss, symbols, drive=drive, opening=opening)
    return ca.Function("needs", symbols, [ca.vertcat(*needs)], {"cse": True})


def _available(
    margin: MarginRequirements,
    truss: TrussParameters,
    drive: Drive | None,
    angle: Array,
    speed: Array,
) -> Array | None:
    """What the motor can pull on each rope before derating (m,) [N]; None where it is not said."""
    stowed = float(rope_length(truss, truss.stowed_angle))
    wound = stowed - _row(rope_length(truss, ca.DM(angle)))
    winding = -_row(rope_speed(truss, ca.DM(angle), ca.DM(speed)))
    limits = available_forces(margin, drive, winding, wound)
    if not limits:
        return None
    found: Array = np.min([limit + 0.0 * angle for limit in limits], axis=0)
    if margin.available is None and drive is not None and drive.torque_speed is not None:
        fastest = drive.torque_speed[-1][0]  # beyond it the motor has nothing
        found[motor_speed(drive, winding, wound) > fastest] = 0.0
    return found


def _row(values: Any) -> Array:
    found: Array = values.full().ravel()
    return found


def records(travel: Travel) -> list[dict[str, Any]]:
    """The least margins of each case and kind, for tables; the governing ones are marked."""
    lines = []
    for place, kind in enumerate(KINDS):
        governing, _ = travel.worst(kind)
        for case in travel.cases:
            k = int(case.by_margin(kind)[0])
            name, share = governing_contribution(case, kind, k)
            least = float(case.margins[kind][k]) if kind in case.margins else None
            lines.append(
                {
                    "margin": kind,
                    "case": case.case.name,
                    "governs": "yes" if case is governing else "no",
                    "least": least,
                    "asked": travel.margin.required[place],
                    "angle_deg": math.degrees(float(travel.angle[k])),
                    "time_s": float(travel.time[k]),
                    "force_N": float(case.required[kind][k]),
                    "motor_N": float(case.needed[kind].max()),
                    "mostly": WORDS[name],
                    "share": share,
                }
            )
    return lines


def governing_contribution(case: CaseAlongTheTravel, kind: str, k: int) -> tuple[str, float]:
    """The largest contribution to a required force at a place, and its share."""
    names = AT_REST if kind == "static" else CONTRIBUTIONS
    values = {name: float(case.parts[name][k]) for name in names}
    if kind == "static":  # the friction of pulleys on what is there at rest
        values["pulley_friction"] = float(case.required[kind][k]) - sum(values.values())
    name = max(values, key=lambda one: values[one])
    total = float(case.required[kind][k])
    return name, values[name] / total if total > 0 else math.nan


def sentences(travel: Travel) -> list[str]:
    """What governs, every number that was asked for, and what a measured curve lost."""
    lines = []
    for place, kind in enumerate(KINDS):
        case, k = travel.worst(kind)
        name, share = governing_contribution(case, kind, k)
        asked = travel.margin.required[place]
        where = (
            f"at {math.degrees(travel.angle[k]):.2f} deg ({travel.time[k]:.4g} s), case "
            f"'{case.case.name}', {100 * share:.0f} % of it {WORDS[name]}"
        )
        need = f"the motor needs {case.needed[kind].max():.6g} N for each rope"
        if kind in case.margins:
            least = float(case.margins[kind][k])
            need = f"minimum {100 * least:.1f} % (required {100 * asked:g} %)"
        lines.append(f"{kind} margin: {need}, {where}")
    if travel.available is not None:
        spare = float((travel.available - travel.needed()).min())
        what = (
            f"{spare:.4g} N more than needed"
            if spare >= 0.0
            else f"{-spare:.4g} N less than needed"
        )
        if abs(spare) <= TOLERANCE * float(travel.needed().max()):
            what = "exactly the force needed"
        lines.append(f"for all margins the motor has {what} for each rope")
    by_source: dict[str, list[str]] = {}
    for line in travel.margin.sources():
        by_source.setdefault(line["source"], []).append(f"{line['number']} {line['value']:g}")
    lines += [f"{', '.join(numbers)}: {source}" for source, numbers in by_source.items()]

    curve = travel.margin.resistance
    if curve is not None and len(curve) > MOST_ROWS:
        lines.append(
            f"the measured curve of {len(curve)} rows is used at {MOST_ROWS} angles; its error at "
            f"the rows is at most {thinning_error(curve):.2g} N m"
        )
    return lines


def criteria(travel: Travel) -> list[Criterion]:
    """The margins that are asked for, held against the least ones."""
    held = []
    for place, kind in enumerate(KINDS):
        case, k = travel.worst(kind)
        if kind not in case.margins:
            continue
        least, asked = float(case.margins[kind][k]), travel.margin.required[place]
        passed = least >= asked - TOLERANCE * (1 + asked)
        held.append(Criterion(f"{kind} margin (least)", "1", least, asked, passed))
    return held


def series(travel: Travel) -> dict[str, Series]:
    """Columns beside the profile: what the motor needs, the margins, and the governing loads."""
    made = {"motor_force_needed": ("N", travel.needed(), "for the required margins")}
    for kind in KINDS:
        case, _ = travel.worst(kind)
        if kind in case.margins:
            text = f"{kind} margin of the case '{case.case.name}', which governs; 1 is 100 %"
            made[f"{kind}_margin"] = ("1", np.minimum(case.margins[kind], 1e9), text)
    case, _ = travel.worst("dynamic")
    for name in CONTRIBUTIONS:
        if name in ("coulomb_friction", "test_bench", "rotor") and not case.parts[name].any():
            continue
        text = f"{WORDS[name]} on each rope, factored, case '{case.case.name}'"
        made[f"load_{name}"] = ("N", case.parts[name], text)
    return {
        name: Series(unit, "time", values, meaning)
        for name, (unit, values, meaning) in made.items()
    }
