"""What the user asks of the arm: a TOML file, flags on top, or Python; checked before any work.

A study for each question. All but the sequence state one stage of the deployment; all state the
arm in a table `[arm]`.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

from studies.arm.optimal.objectives import OBJECTIVES, RESIDUAL
from studies.arm.replay.full_model import ELEMENTS, MODES, Drive
from studies.arm.search_limits import MOST_ELEMENTS, MOST_MODES, SEQUENCE_SECONDS
from studies.arm.stage import STAGES, Stage, TorqueCaps
from studies.common.arm_description import ArmDescription
from studies.common.configuration import (
    Described,
    Reader,
    check,
    choice,
    finite,
    from_mapping,
    key,
    key_of,
    optional_key,
    positive,
    section,
    whole,
)
from studies.common.exit_codes import StudyError
from studies.common.rates import confidence
from studies.common.sizes import TIME
from studies.truss.carrier import CarryingArm

DURATIONS = {"big": 8.6, "small": 11.2, "both": 11.2}  # [s], a tenth of the paper's
DRIVES: tuple[Drive, ...] = get_args(Drive)
HEAVIEST = 200.0  # inertia of a satellite over that of the straight arm, up to which it may turn
PAPER_TOTAL, OUR_DWELL = 198.0, 10.0  # [s], the paper's 86 and 112 s; the dwell is ours


def _count(most: int) -> Reader:
    """Reader of a whole number from 1 to `most`."""

    def read(name: str, value: Any) -> int:
        number = finite(name, value)
        if number != int(number) or not 1 <= number <= most:
            raise StudyError(f"{name} is {number:g}; give a whole number from 1 to {most}")
        return int(number)

    return Described(read, {"type": "integer", "minimum": 1, "maximum": most})


def _angle(joint: str, when: str) -> Any:
    """The key of an angle of a joint."""
    meaning = f"angle of the {joint} at the {when}, instead of that of the stage"
    return optional_key(finite, "deg", meaning)


@dataclass(frozen=True, kw_only=True)
class StageStudy:
    """One stage of the deployment: what every question but the sequence states."""

    stage: str = key(choice(STAGES), "", f"links that turn: {', '.join(STAGES)}", default="big")
    duration: float | None = optional_key(
        TIME,
        "s",
        "duration of the stage; by default 8.6 for big and 11.2 for small and both",
    )
    root_start_deg: float | None = _angle("root", "start")
    root_end_deg: float | None = _angle("root", "end")
    elbow_start_deg: float | None = _angle("elbow", "start")
    elbow_end_deg: float | None = _angle("elbow", "end")
    arm: ArmDescription = key(section(ArmDescription), "", "the arm", factory=ArmDescription)

    def __post_init__(self) -> None:
        check(self)
        assert self.slew  # made once here, so that a stage that turns nothing is said early

    @cached_property
    def slew(self) -> Stage:
        """The stage with its angles, its duration and its arm."""
        duration = self.duration or DURATIONS[self.stage]
        base = STAGES[self.stage](duration, self.arm.parameters)

        def angles(when: str, defaults: tuple[float, float]) -> tuple[float, float]:
            stated = [getattr(self, f"{joint}_{when}_deg") for joint in ("root", "elbow")]
            root, elbow = (
                default if given is None else math.radians(given)
                for given, default in zip(stated, defaults, strict=True)
            )
            return root, elbow

        start, end = angles("start", base.start), angles("end", base.end)
        return Stage(self.stage, start, end, duration, self.arm.parameters)


@dataclass(frozen=True, kw_only=True)
class ArmStudy(StageStudy):
    """One motion of the arm: `antenna-ocp arm solve`."""

    objective: str = key(
        choice(OBJECTIVES),
        "",
        f"objective to minimise: {', '.join(OBJECTIVES)}; time needs both caps",
        default="smoothest",
    )
    drive: Drive = key(
        choice(DRIVES),
        "",
        "input to the joints until the lock: torque or angle",
        default="torque",
    )
    torque_cap: float | None = optional_key(
        positive, "N m", "cap on the torque of each driven joint"
    )
    rate_cap: float | None = optional_key(positive, "N m/s", "cap on the rate of these torques")
    latch: float | None = optional_key(
        positive, "rad", "maximum miss of the end angle of a joint with which it still locks"
    )
    residual_energy: float = key(
        positive,
        "J",
        "maximum residual energy of the full model after the lock",
        default=RESIDUAL,
    )
    sample_time: float | None = optional_key(
        positive,
        "s",
        "sample time of the exported profile; by default the longest that keeps the residual "
        "energy",
    )
    pointing_error: float = key(
        positive, "m", "error of the tip below which it counts as settled", default=1e-4
    )
    satellite_inertia: float | None = key_of(CarryingArm, "satellite_inertia")
    wheel_torque: float | None = optional_key(
        positive, "N m", "cap on the moment about the root on a held satellite"
    )
    wheel_momentum: float | None = optional_key(
        positive, "N m s", "cap on the angular momentum of its wheels"
    )
    elements: int = key(
        _count(MOST_ELEMENTS), "", "elements of a link in the full model", default=ELEMENTS
    )
    modes: int = key(
        _count(MOST_MODES), "", "locked modes whose amplitudes are reported", default=MODES
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_satellite()
        if self.sample_time is not None and self.sample_time > self.slew.duration:
            raise StudyError(
                f"sample_time is {self.sample_time:g} s, more than the stage's "
                f"{self.slew.duration:g} s; give a shorter one"
            )
        # four coordinates a node of either link, less the six that the two locks fix
        most = 8 * (self.elements + 1) - 6
        if self.modes > most:
            raise StudyError(
                f"modes is {self.modes}, but the locked arm has {most} with {self.elements} "
                f"elements for each link; give at most {most} modes, or more elements"
            )

    def _check_satellite(self) -> None:
        check_wheels(self)
        H = self.satellite_inertia
        if H is None:
            return
        # On the full model it also loads the length of the root's slope, as no satellite does: a
        # thousand times the arm's inertia leave 2.5e-6 J there, as much as this 4e-9 J.
        most = HEAVIEST * self.arm.parameters.root_inertia(0.0)
        if most < H:
            raise StudyError(
                f"satellite_inertia is {H:g} kg m^2, more than {most:.3g} kg m^2, {HEAVIEST:g} "
                "times that of the straight arm, a satellite that hardly turns; remove it for a "
                "satellite that is held"
            )
        if len(self.slew.moving) > 1:
            raise StudyError(
                f"satellite_inertia is {H:g} kg m^2, but the stage '{self.stage}' turns both "
                "joints, for which the model supports only a held satellite; give big or small, or "
                "remove satellite_inertia"
            )
        if self.drive == "angle" and not self.slew.carried:
            raise StudyError(
                f"satellite_inertia is {H:g} kg m^2, but the model of a root with a given angle "
                "supports only a held satellite; give drive = torque, or remove satellite_inertia"
            )

    @cached_property
    def slew(self) -> Stage:
        """The stage with its angles, its duration, its arm and its satellite."""
        return dataclasses.replace(super().slew, satellite_inertia=self.satellite_inertia)

    @property
    def caps(self) -> TorqueCaps:
        """The caps of both joints, and of what the satellite's wheels take."""
        torque, rate = self.torque_cap, self.rate_cap
        return TorqueCaps((torque, torque), (rate, rate), self.wheel_torque, self.wheel_momentum)

    @property
    def question(self) -> str:
        """What is asked, in one line."""
        time = "" if self.objective == "time" else f" in {self.slew.duration:.6g} s"
        drive = "" if self.drive == "torque" else f", {self.drive} drive"
        return f"{self.stage} arm{time}{drive}: {OBJECTIVES[self.objective].title}, rest to rest"


@dataclass(frozen=True, kw_only=True)
class BaselinesStudy(StageStudy):
    """An optimum beside each of the paper's laws: `antenna-ocp arm baselines`."""

    drive: Drive = key_of(ArmStudy, "drive")
    latch: float | None = key_of(ArmStudy, "latch")

    @property
    def question(self) -> str:
        """What is asked, in one line."""
        return (
            f"{self.stage} arm in {self.slew.duration:g} s, {self.drive} drive: residual energy of "
            "each law and of an optimum with no higher peak torque"
        )


@dataclass(frozen=True, kw_only=True)
class LeastDurationStudy(StageStudy):
    """Least durations under one torque cap and one residual: `antenna-ocp arm least-duration`."""

    drive: Drive = key_of(ArmStudy, "drive")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_one_joint("arm least-duration", self.slew)

    @property
    def question(self) -> str:
        """What is asked, in one line."""
        return (
            f"{self.stage} arm, {self.drive} drive: the minimum duration without residual vibration"
        )


@dataclass(frozen=True, kw_only=True)
class RobustStudy(StageStudy):
    """One motion for a spread of arms: `antenna-ocp robust arm`."""

    drive: Drive = key_of(ArmStudy, "drive")
    points: int = key(_count(MOST_ELEMENTS), "", "arms on each side of the grid on B21", default=21)
    draws: int = key(
        whole(0, 10_000_000), "", "arms drawn uniformly from the range, on B21", default=1500
    )
    seed: int = key(whole(0), "", "of the draws", default=1)
    confidence: float = key(confidence, "", "of the interval of a rate", default=0.95)
    allowed_energy: float = key(
        positive, "J", "residual energy of an arm above which it is counted", default=RESIDUAL
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_one_joint("robust", self.slew)
        if self.points < 2:
            raise StudyError(f"points is {self.points}; give 2 or more arms on each side")

    @property
    def question(self) -> str:
        """What is asked, in one line."""
        return (
            f"{self.stage} arm in {self.slew.duration:g} s, {self.drive} drive: the motion with "
            "the minimum residual vibration for a range of arms"
        )


@dataclass(frozen=True, kw_only=True)
class SequenceStudy:
    """Big arm, locked dwell and small arm as one problem: `antenna-ocp arm sequence`."""

    least: Literal["peak-torque", "time"] = key(
        choice(("peak-torque", "time")),
        "",
        "peak-torque in a total time, or time under torque_cap",
        default="peak-torque",
    )
    total: float = key(positive, "s", "time of both motions", default=PAPER_TOTAL)
    dwell: float = key(
        positive, "s", "locked time between them, added to the total", default=OUR_DWELL
    )
    torque_cap: float | None = optional_key(positive, "N m", "cap on the torque of both joints")
    lock_energy: float | None = optional_key(
        positive, "J", "also a sequence with up to this energy, instead of rest, at the first lock"
    )
    residual_energy: float = key(
        positive, "J", "maximum residual energy after each lock on the full model", default=RESIDUAL
    )
    sample_time: float | None = key_of(ArmStudy, "sample_time")
    seconds: float = key(
        positive,
        "s",
        "maximum time of the search; the best motion found so far is kept",
        default=SEQUENCE_SECONDS,
    )
    arm: ArmDescription = key(section(ArmDescription), "", "the arm", factory=ArmDescription)

    def __post_init__(self) -> None:
        check(self)
        if self.least == "time" and self.torque_cap is None:
            raise StudyError("the minimum time of a sequence needs torque_cap; give it in N m")
        if self.least != "time" and self.torque_cap is not None:
            raise StudyError(
                f"torque_cap is {self.torque_cap:g}, but the objective is the torque itself; "
                "remove torque_cap, or minimise the time"
            )

    @property
    def question(self) -> str:
        """What is asked, in one line."""
        least = self.least.replace("-", " ")
        return f"big arm, {self.dwell:g} s locked, small arm: minimum {least}, rest at each lock"


def check_wheels(study: Any) -> None:
    """Refuse caps on what the wheels take of a satellite that is free to turn."""
    H = study.satellite_inertia
    for name in ("wheel_torque", "wheel_momentum"):
        if H is not None and (cap := getattr(study, name)) is not None:
            raise StudyError(
                f"{name} is {cap:g}, but the satellite of {H:g} kg m^2 is free to turn, so its "
                "wheels take nothing; remove one of the two keys"
            )


def check_one_joint(question: str, stage: Stage) -> None:
    """Refuse a stage that turns both joints."""
    if len(stage.moving) > 1:
        raise StudyError(
            f"{question} turns one joint, the stage '{stage.name}' both; give big or small"
        )


def study_from(raw: Mapping[str, Any]) -> ArmStudy:
    """The study of one motion that a nested dictionary states.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    return from_mapping(ArmStudy, raw)


def as_dictionary(study: Any) -> dict[str, Any]:
    """The nested dictionary that states the same study again, its duration resolved."""
    content = dataclasses.asdict(study)
    if isinstance(study, StageStudy):
        content["duration"] = study.slew.duration
    arm = content.pop("arm")
    return {name: value for name, value in content.items() if value is not None} | {"arm": arm}
