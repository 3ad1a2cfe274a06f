"""What the user asks of the truss: one TOML file, its flags on top, checked before any work.

The same nested dictionary comes from the file and from the flags; `study_from` turns it into a
frozen `TrussStudy` and names every key it does not know.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import numbers
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from models.errors import ModelError
from models.laws import PAPER_POINTS, Bezier, Step5, peaks, pinned
from models.truss import DYNAMIC_SET, KINEMATIC_SET, JointMasses, TrussParameters
from studies.common.exit_codes import StudyError
from studies.truss.quantities import OBJECTIVES

DEPLOYED = math.pi / 2  # [rad]
PAPER_DURATION = 140.0  # [s], follows from the paper's 5.7e-4 rad/s^2 and (40)
SETS = {"dynamic": DYNAMIC_SET, "kinematic": KINEMATIC_SET}
STARTS = ("bezier", "step5", "straight", "dwell", "phase-plane")


@dataclass(frozen=True, kw_only=True)
class Caps:
    """Limits that hold at all times; None is no limit.

    Attributes
    ----------
    speed, acceleration, jerk : of the deployment angle [rad/s], [rad/s^2], [rad/s^3].
    force : of the motor on each rope [N].
    least_tension : of every rope segment [N]; a rope only pulls, so at least 0.
    """

    speed: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    force: float | None = None
    least_tension: float = 0.0


@dataclass(frozen=True, kw_only=True)
class SolverOptions:
    """How to solve.

    Attributes
    ----------
    intervals : mesh intervals to start from, over the whole motion.
    starts : names of the laws to start from.
    """

    intervals: int = 40
    starts: tuple[str, ...] = STARTS


@dataclass(frozen=True, kw_only=True)
class TrussStudy:
    """One optimal deployment of the ring truss.

    Attributes
    ----------
    minimise : stages, most important first; each a mapping from objective to weight.
    duration : shortest and longest duration [s]; equal if it is fixed.
    concession : relative worsening of a stage's optimum that later stages may use.
    smooth : whether the law is made smooth where a peak leaves it free.
    caps, truss, solver : the rest.
    """

    minimise: tuple[Mapping[str, float], ...]
    duration: tuple[float, float] = (PAPER_DURATION, PAPER_DURATION)
    concession: float = 5e-5
    smooth: bool = True
    caps: Caps = dataclasses.field(default_factory=Caps)
    truss: TrussParameters = DYNAMIC_SET
    solver: SolverOptions = dataclasses.field(default_factory=SolverOptions)

    @property
    def stroke(self) -> float:
        """D [rad]."""
        return DEPLOYED - self.truss.stowed_angle

    @property
    def fixed_duration(self) -> float | None:
        """T [s], None if it is free."""
        return self.duration[0] if self.duration[0] == self.duration[1] else None

    @property
    def objectives(self) -> tuple[str, ...]:
        """Names of all objectives, in order."""
        return tuple(dict.fromkeys(name for stage in self.minimise for name in stage))

    @property
    def name(self) -> str:
        """Default name of the results folder."""
        return "truss-" + "-".join(self.objectives)


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file."""
    try:
        return tomllib.loads(path.read_text("utf-8"))
    except OSError as error:
        raise StudyError(f"the file {path} cannot be read ({error.strerror})") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise StudyError(f"the file {path} is not valid TOML: {error}") from error


def study_from(raw: Mapping[str, Any]) -> TrussStudy:
    """Check a nested dictionary and return the study it states.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    _check_keys(raw, ("minimise", "duration", "concession", "smooth", "caps", "truss", "solver"))
    if "minimise" not in raw:
        raise StudyError(
            f"no objective is stated; give --objective or minimise, one of {_listed(OBJECTIVES)}"
        )
    study = TrussStudy(
        minimise=_stages(raw["minimise"]),
        duration=_duration(raw.get("duration", PAPER_DURATION)),
        concession=_number("concession", raw.get("concession", 5e-5)),
        smooth=_boolean("smooth", raw.get("smooth", True)),
        truss=_truss(_section(raw, "truss")),
        solver=_solver(_section(raw, "solver")),
    )
    if "time" in study.objectives and study.fixed_duration is not None:
        raise StudyError(
            f"the objective time needs bounds on the duration, but it is fixed at "
            f"{study.fixed_duration:g} s; give --duration LOW..HIGH or duration = [low, high]"
        )
    return dataclasses.replace(study, caps=_caps(_section(raw, "caps"), study))


def law_jerk(name: str, duration: float, stowed_angle: float) -> float:
    """Peak jerk [rad/s^3] of one of the paper's laws."""
    if name == "bezier":
        return peaks(Bezier(duration, pinned(PAPER_POINTS, stowed_angle, DEPLOYED))).jerk
    return peaks(Step5(duration, stowed_angle, DEPLOYED)).jerk


def _section(raw: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    section = raw.get(name, {})
    if not isinstance(section, Mapping):
        raise StudyError(f"{name} is {section!r}; make it a table: [{name}]")
    return section


def _check_keys(raw: Mapping[str, Any], known: Iterable[str], where: str = "") -> None:
    known = list(known)
    for key in raw:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
            hint = f"did you mean {where}{near[0]}?" if near else f"known are {_listed(known)}"
            raise StudyError(f"unknown key {where}{key}; {hint}")


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)


def _number(key: str, value: Any, *, zero: bool = False) -> float:
    real = isinstance(value, numbers.Real) and not isinstance(value, bool)
    if not (real and math.isfinite(value) and (value > 0 or (zero and value == 0))):
        kind = "non-negative" if zero else "positive"
        raise StudyError(f"{key} is {value!r}; give a finite {kind} number")
    return float(value)


def _integer(key: str, value: Any, least: int) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise StudyError(f"{key} is {value!r}; give a whole number of at least {least}")
    return value


def _boolean(key: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise StudyError(f"{key} is {value!r}; give true or false")
    return value


def _choice(key: str, value: Any, choices: Iterable[str]) -> str:
    choices = list(choices)
    if value not in choices:
        near = difflib.get_close_matches(str(value), choices, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]}?" if near else f"choose one of {_listed(choices)}"
        raise StudyError(f"{key} is {value!r}; {hint}")
    return str(value)


def _stages(value: Any) -> tuple[dict[str, float], ...]:
    """One objective, a table of weights, or a list of these in order of importance."""
    if isinstance(value, list) and value:
        return tuple(stage for item in value for stage in _stages(item))
    if isinstance(value, Mapping) and value:
        _check_keys(value, OBJECTIVES, "minimise.")
        return ({name: _number(f"minimise.{name}", weight) for name, weight in value.items()},)
    return ({_choice("minimise", value, OBJECTIVES): 1.0},)


def _duration(value: Any) -> tuple[float, float]:
    if not isinstance(value, list):
        return (_number("duration", value),) * 2
    if len(value) != 2:
        raise StudyError(f"duration is {value!r}; give a number or [low, high] in seconds")
    low, high = _number("duration", value[0]), _number("duration", value[1])
    if low > high:
        raise StudyError(f"duration is [{low:g}, {high:g}]; give the lower bound first")
    return low, high


def _truss(raw: Mapping[str, Any]) -> TrussParameters:
    fields = [field.name for field in dataclasses.fields(TrussParameters)]
    degrees = {"stowed_angle_deg": "stowed_angle", "net_angle_deg": "net_angle"}
    _check_keys(raw, ["set", *fields, *degrees], "truss.")
    base = SETS[_choice("truss.set", raw.get("set", "dynamic"), SETS)]
    changes = {key: value for key, value in raw.items() if key not in ("set", *degrees)}
    for key, radians in degrees.items():
        if key in raw:
            changes[radians] = math.radians(_number(f"truss.{key}", raw[key]))
    if "joint_masses" in changes:
        changes["joint_masses"] = _joint_masses(changes["joint_masses"])
    try:
        return dataclasses.replace(base, **changes)
    except ModelError as error:
        raise StudyError(str(error)) from error


def _joint_masses(raw: Any) -> JointMasses:
    if not isinstance(raw, Mapping):
        raise StudyError(f"truss.joint_masses is {raw!r}; make it a table of masses in kg")
    known = [field.name for field in dataclasses.fields(JointMasses)]
    _check_keys(raw, known, "truss.joint_masses.")
    try:
        return JointMasses(**raw)
    except ModelError as error:
        raise StudyError(str(error)) from error


def _solver(raw: Mapping[str, Any]) -> SolverOptions:
    _check_keys(raw, ("intervals", "starts"), "solver.")
    starts = raw.get("starts", list(STARTS))
    if not isinstance(starts, list) or not starts:
        raise StudyError(f"solver.starts is {starts!r}; give a list out of {_listed(STARTS)}")
    return SolverOptions(
        intervals=_integer("solver.intervals", raw.get("intervals", 40), 2),
        starts=tuple(_choice("solver.starts", start, STARTS) for start in starts),
    )


def _caps(raw: Mapping[str, Any], study: TrussStudy) -> Caps:
    _check_keys(raw, [field.name for field in dataclasses.fields(Caps)], "caps.")
    given = {key: value for key, value in raw.items() if value != "none"}
    least = _number("caps.least_tension", given.pop("least_tension", 0.0), zero=True)
    readers: dict[str, Callable[[Any], float]] = {"jerk": lambda value: _jerk_cap(value, study)}
    return Caps(
        least_tension=least,
        **{
            key: readers.get(key, lambda value, key=key: _number(f"caps.{key}", value))(value)
            for key, value in given.items()
        },
    )


def _jerk_cap(value: Any, study: TrussStudy) -> float:
    """A number [rad/s^3], "x/T^3", or the peak jerk of one of the paper's laws."""
    if not isinstance(value, str):
        return _number("caps.jerk", value)
    multiple = re.fullmatch(r"\s*([-+.\deE]+)\s*/\s*T\^3\s*", value)
    if multiple is None and value not in ("bezier", "step5"):
        raise StudyError(
            f"caps.jerk is {value!r}; give a number in rad/s^3, a multiple like 124.22/T^3, "
            "bezier or step5 for that law's own peak jerk, or none"
        )
    duration = study.fixed_duration
    if duration is None:
        raise StudyError(f"caps.jerk is {value!r}, but the duration is free; give it in rad/s^3")
    if multiple is None:
        return law_jerk(value, duration, study.truss.stowed_angle)
    return _number("caps.jerk times T^3", as_number(multiple[1])) / duration**3


def as_number(text: str) -> Any:
    """The number that `text` spells, or the text itself."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
