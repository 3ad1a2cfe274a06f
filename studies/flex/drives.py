"""What is done at each joint: the laws of a case as joints of the models.

Symbols: T time of a law [s], J rigid inertia about a joint [kg m^2], pace multiple of the speed.
"""

from __future__ import annotations

import csv
import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.ancf.joints import Driven, Free, Joint, Locked, Torque
from models.laws import Law, Step5
from models.laws.unit_turns import bezier, linear_torque, quintic
from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.flex.config import FlexStudy, JointCase
from studies.flex.expressions import read_law

History = Callable[[Array], tuple[Array, Array, Array]]
"""Times (m,) [s] to a value and its two derivatives, (m,) each."""

LEAST_ROWS = {"angle": 6, "torque": 4}  # a quintic and a cubic spline need as many
CHECKED = 2001  # instants at which a law is tried before any work


def _step5(duration: float) -> Law:
    return Step5(duration, 0.0, 1.0)


UNIT_LAWS: dict[str, Callable[[float], Law]] = {
    "linear": linear_torque,
    "step5": _step5,
    "bezier": bezier,
    "quintic": quintic,
}


@dataclass(frozen=True, eq=False)
class JointLaw:
    """The law of one driven joint at the pace of the case.

    Attributes
    ----------
    history : angle [rad] or torque [N m], with derivatives.
    breakpoints : times at which it or a derivative jumps [s].
    text : how a sentence calls it.
    """

    history: History
    breakpoints: tuple[float, ...]
    text: str

    def joint(self, kind: str) -> Joint:
        """The joint of the models."""
        if kind == "torque":
            return Torque(lambda t: self.history(t)[0], self.breakpoints)
        angle, rate, acceleration = (self._part(order) for order in range(3))
        return Driven(angle, rate, acceleration, self.breakpoints)

    def _part(self, order: int) -> Callable[[Array], Array]:
        return lambda t: self.history(t)[order]


def joint_of(study: FlexStudy, place: int, inertia: float) -> Joint:
    """The joint of the models that a case states.

    Parameters
    ----------
    inertia : float
        J of all that hangs on the joint, in the pose of the start [kg m^2].
    """
    case = study.joint[place]
    if case.kind == "free":
        return Free()
    if case.kind == "locked":
        return Locked(case.start)
    return joint_law(study, place, inertia).joint(case.kind)


def joint_law(study: FlexStudy, place: int, inertia: float = 0.0) -> JointLaw:
    """The law of a driven joint.

    Raises
    ------
    StudyError
        If an expression or a table is wrong.
    """
    case, name = study.joint[place], f"joint[{place}]"
    if case.law is not None:
        nominal = _by_name(study, case, inertia)
    elif case.expression is not None:
        law = read_law(f"{name}.expression", case.expression, study.duration)
        nominal = JointLaw(law.at, case.breakpoints, f"expression {law.text!r}")
    else:
        nominal = _by_table(study, case, name)
    return _paced(nominal, study.pace, case.kind)


def _paced(law: JointLaw, pace: float, kind: str) -> JointLaw:
    """A law at another pace: angles stay, torques grow with the accelerations."""
    size = pace**2 if kind == "torque" else 1.0

    def history(t: Array) -> tuple[Array, Array, Array]:
        value, rate, acceleration = law.history(pace * t)
        return size * value, size * pace * rate, size * pace**2 * acceleration

    return JointLaw(history, tuple(t / pace for t in law.breakpoints), law.text)


def _by_name(study: FlexStudy, case: JointCase, inertia: float) -> JointLaw:
    """A rest-to-rest law of a turn, or the torque that turns the rigid chain along it."""
    assert case.law is not None
    assert case.turn_deg is not None
    T = case.over or study.duration
    unit, turn = UNIT_LAWS[case.law](T), math.radians(case.turn_deg)

    def angle(t: Array) -> tuple[Array, Array, Array]:
        inside = t <= T
        motion = unit.motion(np.clip(t, 0.0, T))
        value = case.start + turn * motion.angle
        return value, turn * motion.speed * inside, turn * motion.acceleration * inside

    def torque(t: Array) -> tuple[Array, Array, Array]:
        acceleration = angle(t)[2]
        return inertia * acceleration, np.zeros_like(t), np.zeros_like(t)

    edges = (*unit.breakpoints, *((T,) if study.duration > T else ()))
    return JointLaw(angle if case.kind == "angle" else torque, edges, f"law {case.law}")


def _by_table(study: FlexStudy, case: JointCase, name: str) -> JointLaw:
    """A spline through a table: quintic for an angle, cubic for a torque."""
    from scipy.interpolate import make_interp_spline

    least, (times, values) = LEAST_ROWS[case.kind], (np.array(case.times), np.array(case.values))
    if times.size != values.size or times.size < least:
        raise StudyError(
            f"{name} has {times.size} times and {values.size} values; give equally many, at "
            f"least {least}"
        )
    if times[0] != 0.0 or (np.diff(times) <= 0).any():
        raise StudyError(f"{name}: its times do not start at 0 and increase; sort and shift them")
    needed = min(case.lock_time or study.duration, study.duration)
    if times[-1] < needed:
        raise StudyError(
            f"{name}: its table ends at {times[-1]:g} s, before {needed:g} s; give rows up to "
            f"{needed:g} s, or a lock_time"
        )
    spline = make_interp_spline(times, values, k=least - 1)

    def history(t: Array) -> tuple[Array, Array, Array]:
        inside = np.clip(t, 0.0, times[-1])
        return spline(inside), spline(inside, nu=1), spline(inside, nu=2)

    return JointLaw(history, case.breakpoints, "table")


def check_laws(study: FlexStudy) -> None:
    """Raise StudyError if a law is not finite somewhere in the time of the motion."""
    t = np.linspace(0.0, study.time, CHECKED)
    for place, case in enumerate(study.joint):
        if case.kind not in ("angle", "torque"):
            continue
        law = joint_law(study, place, 1.0)
        values = law.history(t)
        for k, what in enumerate(("", " as its rate", " as its acceleration")):
            wrong = np.flatnonzero(~np.isfinite(values[k]))
            if wrong.size and (k == 0 or case.kind == "angle"):
                raise StudyError(
                    f"joint[{place}]: its {law.text} gives {values[k][wrong[0]]:g}{what} at "
                    f"t = {t[wrong[0]]:.4g} s; give a law that is finite from 0 to "
                    f"{study.time:g} s"
                )


def with_tables(study: FlexStudy, folder: Path) -> FlexStudy:
    """The study with the CSV files of its joints read into tables."""
    joints = [
        case if case.csv is None else _from_csv(case, folder / case.csv, f"joint[{place}]")
        for place, case in enumerate(study.joint)
    ]
    return dataclasses.replace(study, joint=tuple(joints))


def _from_csv(case: JointCase, path: Path, name: str) -> JointCase:
    """A joint whose table comes from a file: columns time, and angle, angle_deg or torque."""
    try:
        lines = path.read_text("utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text"
        raise StudyError(f"{name}: the file {path} cannot be read ({reason})") from error

    rows = list(csv.reader(line for line in lines if line.strip() and not line.startswith("#")))
    head = [cell.split("[")[0].strip().lower() for cell in rows[0]] if rows else []
    wanted = ("angle", "angle_deg") if case.kind == "angle" else ("torque",)
    column = next((word for word in wanted if word in head), "")
    if "time" not in head or not column:
        raise StudyError(
            f"{name}: {path} has the columns {', '.join(head) or 'none'}; give time and "
            f"{' or '.join(wanted)}"
        )
    try:
        table = np.array(
            [[float(row[head.index(c)]) for c in ("time", column)] for row in rows[1:]]
        )
    except (ValueError, IndexError) as error:
        raise StudyError(f"{name}: {path} has a row that is not numeric ({error})") from error
    if not np.isfinite(table).all():
        raise StudyError(f"{name}: {path} has a value that is not finite; remove its row")
    table = table.reshape(-1, 2)
    values = np.radians(table[:, 1]) if column == "angle_deg" else table[:, 1]
    return dataclasses.replace(
        case, csv=None, times=tuple(table[:, 0].tolist()), values=tuple(values.tolist())
    )
