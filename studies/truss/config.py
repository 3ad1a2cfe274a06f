"""What the user asks of the truss: one TOML file, its flags on top, checked before any work.

The same nested dictionary comes from the file and from the flags; `study_from` turns it into a
frozen `TrussStudy`. A `TrussStudy` made in Python is checked in the same way.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from models.errors import ModelError
from studies.common.configuration import (
    Flag,
    as_number,
    as_stated,
    boolean,
    check,
    check_keys,
    choice,
    choices,
    describes,
    from_mapping,
    key,
    not_negative,
    optional_key,
    part_below_one,
    positive,
    section,
    table,
    whole,
    with_commas,
)
from studies.common.exit_codes import StudyError, quoted
from studies.drive.schema import Drive, drive_of_file
from studies.margin.schema import MarginRequirements, read_margin
from studies.truss.carrier import RESIDUAL, CarryingArm, arm_of_file
from studies.truss.limits.caps import (
    MULTIPLE_OF_DURATION,
    Caps,
    check_stated,
    with_margins_kept,
    within_the_drive,
)
from studies.truss.quantities import OBJECTIVES
from studies.truss.stated_together import (
    ONE_WAY,
    check_duration,
    check_loads,
    check_opening,
    check_plausible_values,
    check_stretch,
)

if TYPE_CHECKING:  # CasADi loads with the models, and not for a table of keys
    from models.ring_on_arm import RingOnArm
    from models.truss import JointMasses, Opening, TrussParameters

DEPLOYED = math.pi / 2  # [rad]
PAPER_DURATION = 140.0  # [s], follows from the paper's 5.7e-4 rad/s^2 and (40)
SETS = ("dynamic", "kinematic")  # of parameters, as the paper has them
# of Coulomb friction, of a test bench and measured; none of them is the paper's
LOADS = ("other_pulleys", "gravity", "off_load", *ONE_WAY)
ENDS = ("start_deg", "start_rate_deg_per_s", "end_deg")  # of a motion that is not all of it
STARTS = ("bezier", "step5", "straight", "dwell", "phase-plane")


@describes(
    {"anyOf": [{"enum": list(OBJECTIVES)}, {"type": "object"}, {"type": "array", "minItems": 1}]}
)
def _stages(name: str, value: Any) -> tuple[dict[str, float], ...]:
    """One objective, a table of weights, or a list of these in order of importance."""
    if isinstance(value, list | tuple) and value:
        stages = tuple(stage for item in value for stage in _stages(name, item))
        alone = [next(iter(stage)) for stage in stages if len(stage) == 1]
        for objective in alone:
            if alone.count(objective) > 1:
                raise StudyError(
                    f"{name} contains {objective} {alone.count(objective)} times; give it once"
                )
        return stages
    if isinstance(value, Mapping) and value:
        check_keys(value, OBJECTIVES, f"{name}.")
        return ({term: positive(f"{name}.{term}", weight) for term, weight in value.items()},)
    return ({choice(OBJECTIVES)(name, value): 1.0},)


@describes({"anyOf": [positive.schema, {"type": "array", "minItems": 2, "maxItems": 2}]})
def _duration(name: str, value: Any) -> tuple[float, float]:
    """A number, or a shortest and a longest duration."""
    if not isinstance(value, list | tuple):
        fixed = positive(name, value)
        return fixed, fixed
    if len(value) != 2:
        raise StudyError(f"{name} is {quoted(value)}; give a number or [low, high] in seconds")
    if "" in (value[0], value[1]):
        raise StudyError(
            f"{name} runs from {quoted(value[0])} to {quoted(value[1])}; give both ends in "
            "seconds, as 2..60"
        )
    low, high = positive(name, value[0]), positive(name, value[1])
    if low > high:
        raise StudyError(f"{name} is [{low:g}, {high:g}]; give the lower bound first")
    return low, high


def _ends(text: str) -> Any:
    """A duration, or LOW..HIGH."""
    ends = [as_number(end.strip()) for end in text.split("..")]
    return ends[0] if len(ends) == 1 else ends


_share = part_below_one(": a later objective may worsen an earlier one by this fraction")


def _parameters_class() -> type[Any]:
    from models.truss import TrussParameters

    return TrussParameters


def _dynamic_set() -> TrussParameters:
    from models.truss import DYNAMIC_SET

    return DYNAMIC_SET


_FURTHER = {
    "set": {
        "enum": list(SETS),
        "description": "parameter set of the paper, from which the other keys differ",
    },
    "stowed_angle_deg": {"type": "number", "description": "stowed_angle in degrees [deg]"},
    "net_angle_deg": {"type": "number", "description": "net_angle in degrees [deg]"},
}


@describes({"type": "object", "properties": _FURTHER}, _parameters_class)
def truss_parameters(name: str, value: Any) -> TrussParameters:
    """Parameters of the model, or a table of those that differ from one of the paper's sets."""
    from models.truss import DYNAMIC_SET, KINEMATIC_SET, TrussParameters

    if isinstance(value, TrussParameters):
        return value
    raw = table(name, value)
    fields = [field.name for field in dataclasses.fields(TrussParameters)]
    degrees = {"stowed_angle_deg": "stowed_angle", "net_angle_deg": "net_angle"}
    check_keys(raw, ["set", *fields, *degrees], f"{name}.")

    changes = {key: item for key, item in raw.items() if key not in ("set", *degrees)}
    for in_degrees, radians in degrees.items():
        if in_degrees not in raw:
            continue
        if radians in raw:
            raise StudyError(
                f"{name} has {radians} = {quoted(raw[radians])} and {in_degrees} = "
                f"{quoted(raw[in_degrees])}, which are the same angle; give one of them"
            )
        changes[radians] = math.radians(positive(f"{name}.{in_degrees}", raw[in_degrees]))

    chosen = choice(SETS)(f"{name}.set", raw.get("set", "dynamic"))
    base = DYNAMIC_SET if chosen == "dynamic" else KINEMATIC_SET

    try:
        changes |= _rows(name, changes)
        if "joint_masses" in changes:
            changes["joint_masses"] = _joint_masses(f"{name}.joint_masses", raw["joint_masses"])
        return dataclasses.replace(base, **changes)
    except ModelError as error:
        raise StudyError(_with_table(str(error), name, fields)) from error


@describes(truss_parameters.schema, truss_parameters.table)
def ring_in_space(name: str, value: Any) -> TrussParameters:
    """The ring of a study that also moves an arm: as a study of the truss reads it, but no weight.

    Raises
    ------
    StudyError
        If gravity is stated.
    """
    del name  # the study of the truss says its own
    truss = TrussStudy(minimise="energy", truss=value).truss
    if any(truss.gravity):
        raise StudyError(
            f"truss.gravity is {list(truss.gravity)}, but the models of the arm include no weight; "
            "remove it, or use a study of the truss"
        )
    return truss


def _with_table(sentence: str, name: str, keys: Sequence[str]) -> str:
    """A sentence of the model, which knows no tables, about a key of one."""
    return f"{name}.{sentence}" if sentence.split()[0] in keys else sentence


def _rows(name: str, stated: Mapping[str, Any]) -> dict[str, Any]:
    """Lists of a file as the tuples that the model holds."""
    from studies.margin.resistance import curve_of

    found: dict[str, Any] = {}
    if isinstance(gravity := stated.get("gravity"), list):
        found["gravity"] = tuple(gravity)
    if isinstance(rows := stated.get("other_pulleys"), list):
        found["other_pulleys"] = tuple(tuple(r) if isinstance(r, list) else r for r in rows)
    if "measured_torque" in stated:
        curve = stated["measured_torque"]
        found["measured_torque"] = curve_of(f"{name}.measured_torque", curve) if curve else ()
    return found


def _joint_masses(name: str, raw: Any) -> JointMasses:
    from models.truss import JointMasses

    if not isinstance(raw, Mapping):
        raise StudyError(f"{name} is {quoted(raw)}; make it a table of masses in kg")
    check_keys(raw, [field.name for field in dataclasses.fields(JointMasses)], f"{name}.")
    return JointMasses(**raw)


@dataclass(frozen=True, kw_only=True)
class SolverOptions:
    """How to solve.

    Attributes
    ----------
    intervals : initial number of mesh intervals, over the whole motion.
    starts : names of the laws to start from.
    seconds : that all starts together may take [s]; the best until then is kept.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    intervals: int = key(
        whole(2), "", "initial number of mesh intervals, over the whole motion", default=40
    )
    starts: tuple[str, ...] = key(
        choices(STARTS),
        "",
        "laws from which the solver starts, one after the other",
        default=STARTS,
        flags=(Flag("--starts", metavar="A,B", read=with_commas),),
    )
    seconds: float = key(
        positive,
        "s",
        "maximum time of the search; the best motion found so far is kept",
        default=300.0,
    )

    def __post_init__(self) -> None:
        check(self, "solver.")


@dataclass(frozen=True, kw_only=True)
class TrussStudy:
    """One optimal deployment of the ring truss.

    What TOML may say, Python may say too: `TrussStudy(minimise="energy", duration=5.0)`. The
    attributes are what this stands for.

    Attributes
    ----------
    minimise : stages, most important first; each a mapping from objective to weight.
    duration : shortest and longest duration [s]; equal if it is fixed.
    concession : relative worsening of a stage's optimum that later stages may use.
    smooth : smooth the law at times when no peak determines it.
    start_deg, start_rate_deg_per_s, end_deg : where the ring starts, how fast it turns there, and
        where it comes to rest; `opening` has them in radians.
    caps : limits that hold at all times, those of the drive among them.
    truss, solver : the rest.
    margin : that the motor has to have; None where none are asked for.
    drive : whose limits are caps, too, and that exports are made for; None where there is none.
    arm : that carries the ring and is shaken by it; None where the fixed bar is held.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    minimise: Any = key(
        _stages,
        "",
        "an objective, a table of objectives and weights, or a list of these in order of "
        f"importance; objectives are {', '.join(OBJECTIVES)}",
        flags=(Flag("--objective", meaning=f"objective to minimise: {', '.join(OBJECTIVES)}"),),
    )
    duration: Any = key(
        _duration,
        "s",
        "duration of the deployment; [low, high] makes it free within this range",
        default=PAPER_DURATION,
        flags=(
            Flag(
                "--duration",
                meaning="duration [s]; LOW..HIGH makes it free within this range",
                metavar="T",
                read=_ends,
            ),
        ),
    )
    start_deg: float | None = optional_key(
        positive, "deg", "angle at the start of the motion; by default that of the stowed ring"
    )
    start_rate_deg_per_s: float = key(
        not_negative,
        "deg/s",
        "angular speed at the start, for example after a tip-off",
        default=0.0,
    )
    end_deg: float | None = optional_key(
        positive, "deg", "angle at the end of the motion, at rest; by default 90 (open)"
    )
    concession: float = key(
        _share, "", "relative loss of an earlier objective that a later one may cause", default=5e-5
    )
    smooth: bool = key(
        boolean, "", "smooth the law at times when no peak determines it", default=True
    )
    caps: Caps = key(
        section(Caps), "", "limits that hold at all times", factory=Caps, flags="--{}-cap"
    )
    truss: TrussParameters = key(
        truss_parameters,
        "",
        'parameters of the model; also set = "dynamic" or "kinematic", stowed_angle_deg and '
        "net_angle_deg",
        factory=_dynamic_set,
        flags=(
            Flag(
                "--friction", "pulley_friction", "friction coefficient mu between rope and pulley"
            ),
            Flag("--modules", "modules", "number of modules"),
            Flag("--set", "set", "parameter set of the paper: dynamic or kinematic"),
            Flag(
                "--parameter",
                meaning="any parameter of the model, e.g. link=0.16 or net_angle_deg=82; may be "
                "repeated",
                metavar="NAME=VALUE",
                assigns=True,
            ),
        ),
    )
    solver: SolverOptions = key(section(SolverOptions), "", "how to solve", factory=SolverOptions)
    margin: MarginRequirements | None = optional_key(
        section(MarginRequirements),
        "",
        "margins of the motor; its keys are listed below",
        flags=(
            Flag(
                "--margin",
                meaning="margins of the motor: a preset such as aiaa-s-114, or a TOML file with "
                "[margin]",
                read=read_margin,
            ),
            Flag(
                "--keep-margins",
                "keep",
                "the motion must keep the margins, like its caps",
                value=True,
            ),
        ),
    )
    drive: Drive | None = optional_key(
        section(Drive),
        "",
        "the drive: its limits are also caps, and exports are made for it",
        flags=(
            Flag(
                "--drive",
                meaning="file with the drive, whose limits are caps; by default [drive] of the "
                "study",
                metavar="FILE",
                read=drive_of_file,
            ),
        ),
    )
    arm: CarryingArm | None = optional_key(
        section(CarryingArm),
        "",
        "the arm that carries the ring: the keys of a study of the arm, and reaction_angle_deg, "
        "from the straight arm to the ring's centre",
        flags=(
            Flag(
                "--arm",
                meaning="file of an arm study with the arm that carries the ring; by default [arm] "
                "of the study",
                metavar="FILE",
                read=arm_of_file,
            ),
            Flag(
                "--reaction-angle-deg",
                "reaction_angle_deg",
                "angle from the straight arm to the ring's centre [deg]",
            ),
            Flag(
                "--satellite-inertia",
                "satellite_inertia",
                "inertia of a satellite that is free to turn about the arm's root [kg m^2]",
            ),
            Flag(
                "--ring-as-particle",
                "ring_turns",
                "the ring is a particle that does not turn with the tip",
                value=False,
            ),
        ),
    )

    def __post_init__(self) -> None:
        check(self)
        check_plausible_values(self)
        check_opening(self)
        check_duration(self)
        check_loads(self)
        check_stated(self.caps, self.objectives, self.drive, self.margin, self.arm)
        if self.drive is not None:
            from studies.drive.snap_through import check_rope  # the models load with it

            check_rope(self.truss, self.drive, self.opening)
        check_stretch(self)
        if self.margin is not None:
            self.margin.load_cases(self.truss)  # said before any work

        # only here all that a jerk in words depends on is known, and what the drive can do
        resolved = dataclasses.replace(
            self.caps, jerk=_jerk_cap(self, self.caps.jerk), residual_energy=self._residual_cap()
        )
        within = within_the_drive(resolved, self.drive)
        object.__setattr__(self, "caps", with_margins_kept(within, self.drive, self.margin))

    def _residual_cap(self) -> float | None:
        """The cap on what is left in the arm [J]."""
        stated = self.caps.residual_energy
        if self.ring_on_arm is None or "residual-energy" in self.objectives:
            return stated
        return RESIDUAL if stated is None else stated

    @functools.cached_property
    def ring_on_arm(self) -> RingOnArm | None:
        """The model of the ring on its arm; None without an arm."""
        return None if self.arm is None else self.arm.with_ring(self.truss)

    @functools.cached_property
    def opening(self) -> Opening:
        """The angles of the motion, and its rate at the start."""
        from models.truss import Opening

        degrees, stowed = self.start_deg, self.truss.stowed_angle
        return Opening(
            stowed if degrees is None else max(math.radians(degrees), stowed),
            DEPLOYED if self.end_deg is None else math.radians(self.end_deg),
            math.radians(self.start_rate_deg_per_s),
        )

    @property
    def stroke(self) -> float:
        """D [rad]."""
        return self.opening.stroke

    @property
    def is_whole(self) -> bool:
        """Whether the motion is from rest at the stowed angle to the open ring."""
        from models.truss import whole_opening

        return self.opening == whole_opening(self.truss)

    @property
    def jerk_limited(self) -> bool:
        """Whether the acceleration is continuous, and so zero at each end where the ring rests."""
        capped = self.caps.jerk is not None or self.caps.rope_jerk is not None
        return capped or "peak-rope-jerk" in self.objectives

    @property
    def plans_stretch(self) -> bool:
        """Whether the stretch of the ropes is part of what is optimised."""
        return self.drive is not None and self.drive.plan_stretch

    @property
    def fixed_duration(self) -> float | None:
        """T [s], None if it is free."""
        low, high = self.duration
        return float(low) if low == high else None

    @property
    def objectives(self) -> tuple[str, ...]:
        """Names of all objectives, in order."""
        return tuple(dict.fromkeys(name for stage in self.minimise for name in stage))

    @property
    def name(self) -> str:
        """Default name of the results folder."""
        return "truss-" + "-".join(self.objectives)

    @property
    def question(self) -> str:
        """What is asked, in one line."""
        low, high = self.duration
        time = f"T = {low:g} s" if low == high else f"T from {low:g} to {high:g} s"
        aims = ", then ".join(_aim(stage) for stage in self.minimise)
        stated = (name for name in LOADS if any(_as_row(getattr(self.truss, name))))
        loads = ", ".join(name.replace("_", " ") for name in stated)
        return (
            f"Ring truss, {self.truss.modules} modules, mu = {self.truss.pulley_friction:g}, "
            f"{time}{ends_in_words(self)}{f', with {loads}' if loads else ''}: minimum {aims}"
        )


def ends_in_words(study: TrussStudy) -> str:
    """Where a motion starts and ends, if it is not all of the opening."""
    if study.is_whole:
        return ""
    start, end, rate = (
        f"{math.degrees(value):.6g}"
        for value in (study.opening.start, study.opening.end, study.opening.rate)
    )
    moving = f" at {rate} deg/s" if study.opening.rate else ""
    return f", from {start} deg{moving} to {end} deg"


def _as_row(value: Any) -> tuple[Any, ...]:
    return value if isinstance(value, tuple) else (value,)


def _aim(stage: Mapping[str, float]) -> str:
    terms = (name if weight == 1 else f"{weight:g} {name}" for name, weight in stage.items())
    return " + ".join(terms)


def study_from(raw: Mapping[str, Any]) -> TrussStudy:
    """Check a nested dictionary and return the study it states.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """
    check_keys(raw, [field.name for field in dataclasses.fields(TrussStudy)])
    if "minimise" not in raw:
        # what else is wrong is said first: this would hide it
        from_mapping(TrussStudy, {**raw, "minimise": "energy"})
        raise StudyError(
            "no objective is given; give --objective, such as --objective peak-force, or minimise "
            "in a file; antenna-ocp truss --help lists all"
        )
    return from_mapping(TrussStudy, raw)


def _jerk_cap(study: TrussStudy, stated: float | str | None) -> float | None:
    """The cap on jerk as a number [rad/s^3]."""
    if not isinstance(stated, str):
        return stated
    duration = study.fixed_duration
    if duration is None:
        raise StudyError(
            f"caps.jerk is {quoted(stated)}, but the duration is free; give it in rad/s^3"
        )

    multiple = MULTIPLE_OF_DURATION.fullmatch(stated)
    if multiple is None:
        return law_jerk(stated, duration, study.opening.start, study.opening.end)
    return positive("caps.jerk times T^3", as_number(multiple[1])) / duration**3


def law_jerk(name: str, duration: float, start: float, end: float = DEPLOYED) -> float:
    """Peak jerk [rad/s^3] of one of the paper's laws between two angles [rad]."""
    return _jerk_of_a_second(name, start, end) / duration**3


@functools.lru_cache(maxsize=256)
def _jerk_of_a_second(name: str, start: float, end: float) -> float:
    """Peak jerk [rad/s^3] of a law of 1 s; kept, as a sweep asks for it thousands of times."""
    from models.laws import Bezier, Step5, paper_points, peaks

    if name == "bezier":
        return peaks(Bezier(1.0, paper_points(start, end))).jerk
    return peaks(Step5(1.0, start, end)).jerk


def as_dictionary(study: TrussStudy) -> dict[str, Any]:
    """The nested dictionary from which `study_from` makes the same study again."""
    stages = [
        next(iter(stage)) if list(stage.values()) == [1.0] else dict(stage)
        for stage in study.minimise
    ]
    low, high = study.duration
    ends = {name: value for name in ENDS if (value := getattr(study, name))}
    return {
        "minimise": stages[0] if len(stages) == 1 else stages,
        "duration": low if low == high else [low, high],
        **ends,
        "concession": study.concession,
        "smooth": study.smooth,
        "caps": as_stated(study.caps),  # a cap that is not stated has no value in TOML
        "solver": {**as_stated(study.solver), "starts": list(study.solver.starts)},
        "truss": dataclasses.asdict(study.truss),
        **({} if study.margin is None else {"margin": study.margin.as_dictionary()}),
        **({} if study.drive is None else {"drive": as_stated(study.drive)}),
        **({} if study.arm is None else {"arm": as_stated(study.arm)}),
    }
