"""What the user asks of the arm: one TOML file, its flags on top, checked before any work."""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from models.arm.parameters import ASSUMED_DENSITY, ASSUMED_MODULUS, ArmParameters, tube
from models.errors import ModelError
from studies.arm.numbers import MOST, NOT_NEGATIVE, NUMBERS, POSITIVE, WHOLE
from studies.arm.optimal.objectives import OBJECTIVES
from studies.arm.optimal.phase import Limits
from studies.arm.replay.full import ELEMENTS, MODES
from studies.arm.stage import STAGES, Stage
from studies.common.exit_codes import StudyError

DURATIONS = {"big": 8.6, "small": 11.2, "both": 11.2}  # [s], a tenth of the paper's
TUBES = {"big": (3.0, 0.060, 0.002), "small": (2.0, 0.050, 0.0015)}  # ours but for the lengths
WORDS = ("stage", "objective")


@dataclass(frozen=True)
class ArmStudy:
    """One motion of the arm.

    Attributes
    ----------
    stage : Stage
    objective : what is least, a key of `OBJECTIVES`.
    limits : caps.
    sample_time : of the exported profile [s].
    pointing_error : of the tip [m].
    latch : largest miss of an end angle that a latch accepts [rad]; None locks anywhere.
    satellite_inertia : of a satellite that is free to turn [kg m^2]; None where it is held.
    elements : of the full model, a link.
    modes : number of locked modes that are reported.
    given : the configuration as read, to reproduce the result.
    """

    stage: Stage
    objective: str
    limits: Limits
    sample_time: float
    pointing_error: float
    latch: float | None
    satellite_inertia: float | None
    elements: int
    modes: int
    given: Mapping[str, Any]


def read(path: Path | None, flags: Mapping[str, Any]) -> ArmStudy:
    """The study of a TOML file with flags on top.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    raw: dict[str, Any] = {}
    if path is not None:
        try:
            raw = tomllib.loads(path.read_text("utf-8"))
        except OSError as error:
            raise StudyError(f"the file {path} cannot be read ({error.strerror})") from error
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise StudyError(f"the file {path} is not valid TOML: {error}") from error
    return study_from({**raw, **{k: v for k, v in flags.items() if v is not None}})


def study_from(raw: Mapping[str, Any]) -> ArmStudy:
    """Check a flat dictionary and return the study it states."""
    for key in raw:
        if key not in (*WORDS, *NUMBERS):
            raise StudyError(f"unknown key {key}; {_hint(key, (*WORDS, *NUMBERS))}")
    values = {k: _number(k, v) for k, v in raw.items() if k in NUMBERS}
    name = _choice("stage", raw.get("stage", "big"), STAGES)
    objective = _choice("objective", raw.get("objective", "smoothest"), OBJECTIVES)
    _check_signs(values)
    stage = _stage(name, _arm(values), values)
    step = values.get("sample_time", 0.1)
    if step > stage.duration:
        raise StudyError(
            f"sample_time is {step:g} s, more than the stage's {stage.duration:g} s; give less"
        )
    torque, rate = values.get("torque_cap"), values.get("rate_cap")
    return ArmStudy(
        stage, objective, Limits((torque, torque), (rate, rate)), step,
        values.get("pointing_error", 1e-4), values.get("latch"), values.get("satellite_inertia"),
        int(values.get("elements", ELEMENTS)), int(values.get("modes", MODES)),
        {"stage": name, "objective": objective, **values},
    )  # fmt: skip


def _stage(name: str, arm: ArmParameters, values: Mapping[str, float]) -> Stage:
    base = STAGES[name](values.get("duration", DURATIONS[name]), arm)

    def angle(joint: str, when: str, default: float) -> float:
        key = f"{joint}_{when}_deg"
        return math.radians(values[key]) if key in values else default

    start, end = (
        (angle("root", when, root), angle("elbow", when, elbow))
        for when, (root, elbow) in (("start", base.start), ("end", base.end))
    )
    return Stage(name, start, end, base.duration, arm)


def _arm(values: Mapping[str, float]) -> ArmParameters:
    material = {"modulus": ASSUMED_MODULUS, "density": ASSUMED_DENSITY}
    stated = {k: values.get(k, default) for k, default in material.items()}
    try:
        links = {}
        for name, sizes in TUBES.items():
            parts = zip(("length", "diameter", "wall"), sizes, strict=True)
            size = {part: values.get(f"{name}_{part}", default) for part, default in parts}
            links[name] = tube(**size, **stated)
        known = ("tip_mass", "elbow_mass", "hub_inertia", "damping_ratio", "damping_frequency")
        others = {k: values[k] for k in known if k in values}
        return ArmParameters(links["big"], links["small"], **others)
    except ModelError as error:
        raise StudyError(str(error)) from error


def _check_signs(values: Mapping[str, float]) -> None:
    for key, value in values.items():
        if key in POSITIVE and value <= 0:
            raise StudyError(f"{key} is {value:g}; give a value above zero")
        if key in NOT_NEGATIVE and value < 0:
            raise StudyError(f"{key} is {value:g}; give zero or more")
        if key in MOST and value > MOST[key]:
            raise StudyError(f"{key} is {value:g}; give {MOST[key]} or less")
        if key in WHOLE and value != int(value):
            raise StudyError(f"{key} is {value:g}; give a whole number")


def _number(key: str, value: Any) -> float:
    try:
        found = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        found = math.nan
    if not math.isfinite(found):
        raise StudyError(f"{key} is {value!r}; give a finite number")
    return found


def _choice(key: str, value: Any, choices: Iterable[str]) -> str:
    if value not in choices:
        raise StudyError(f"{key} is {value!r}; {_hint(str(value), choices)}")
    return str(value)


def _hint(word: str, known: Iterable[str]) -> str:
    known = list(known)
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.5)
    return f"did you mean {near[0]}?" if near else f"choose one of {', '.join(known)}"
