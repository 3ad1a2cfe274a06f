"""The keys of a study of flexible links, from TOML or Python, checked before any work."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

from models.ancf.chain import Link
from models.errors import ModelError
from studies.common.configuration import (
    Flag,
    boolean,
    check,
    choice,
    finite,
    from_mapping,
    key,
    not_negative,
    optional_key,
    positive,
    section,
    whole,
)
from studies.common.exit_codes import StudyError, quoted
from studies.common.sizes import DENSITY, LENGTH, MODULUS, SECTION, TIME, limited
from studies.flex.readers import (
    AREA,
    FACTOR,
    SECOND_MOMENT,
    named_tables,
    numbers,
    numbers_with_commas,
    tables,
    text,
)

KINDS = ("free", "locked", "angle", "torque")
LAWS = ("linear", "step5", "bezier", "quintic")
FORMS = ("minimal", "index-1", "both")
SWEEPS = ("speed", "length", "modulus")

Form = Literal["minimal", "index-1"]


@dataclass(frozen=True, kw_only=True)
class MaterialCase:
    """A material, a table `[material.NAME]`."""

    modulus: float = key(MODULUS, "Pa", "Young's modulus")
    density: float = key(DENSITY, "kg/m^3", "density")

    def __post_init__(self) -> None:
        check(self, "material.")


@dataclass(frozen=True, kw_only=True)
class LinkCase:
    """One link, a table `[[link]]`: its length, one description of its section, and its material.

    Raises
    ------
    StudyError
        If a value is wrong, or the section or the material is missing or given twice.
    """

    length: float = key(LENGTH, "m", "length")
    diameter: float | None = optional_key(SECTION, "m", "outer one of a tube, with wall")
    wall: float | None = optional_key(SECTION, "m", "thickness of the tube's wall; none is a rod")
    width: float | None = optional_key(
        SECTION, "m", "of a rectangle, across the plane, with height"
    )
    height: float | None = optional_key(SECTION, "m", "of the rectangle, in the plane of motion")
    area: float | None = optional_key(AREA, "m^2", "of any section, with second_moment")
    second_moment: float | None = optional_key(
        SECOND_MOMENT, "m^4", "of area, about the axis out of the plane"
    )
    material: str | None = optional_key(text, "", "name of a table [material.NAME]")
    modulus: float | None = optional_key(MODULUS, "Pa", "Young's modulus, instead of material")
    density: float | None = optional_key(DENSITY, "kg/m^3", "density, instead of material")
    end_mass: float = key(limited(not_negative), "kg", "particle at the link's end", default=0.0)

    def __post_init__(self) -> None:
        check(self, "link.")

    def section_of(self, name: str) -> tuple[float, float]:
        """Area [m^2] and second moment of area [m^4].

        Raises
        ------
        StudyError
            If the section is missing, given twice, or impossible.
        """
        ways = {
            "diameter": self.diameter is not None,
            "width and height": self.width is not None or self.height is not None,
            "area and second_moment": self.area is not None or self.second_moment is not None,
        }
        stated = [way for way, given in ways.items() if given]
        if len(stated) != 1:
            which = " and ".join(stated) or "nothing"
            raise StudyError(
                f"{name} gives its section by {which}; give one of diameter (with wall), "
                "width with height, area with second_moment"
            )

        if self.diameter is not None:
            inner = 0.0 if self.wall is None else self.diameter - 2 * self.wall
            if inner < 0:
                raise StudyError(
                    f"{name}.wall is {self.wall:g} m, more than half the diameter of "
                    f"{self.diameter:g} m; reduce it"
                )
            outer = self.diameter
            return math.pi / 4 * (outer**2 - inner**2), math.pi / 64 * (outer**4 - inner**4)
        if self.width is not None and self.height is not None:
            return self.width * self.height, self.width * self.height**3 / 12
        if self.area is not None and self.second_moment is not None:
            return self.area, self.second_moment
        raise StudyError(f"{name} has only one of {stated[0]}; give both")


@dataclass(frozen=True, kw_only=True)
class JointCase:
    """One joint, a table `[[joint]]`, at the start of the link of the same place in the list."""

    kind: str = key(choice(KINDS), "", "free, locked, driven by angle or by torque", default="free")
    start_deg: float | None = optional_key(
        finite,
        "deg",
        "angle at the start, counter-clockwise from the previous link (at the root: from the x "
        "axis); by default 0, or the start of the law",
    )
    start_rate: float = key(
        limited(finite),
        "rad/s",
        "initial rate of that angle, for a free or torque joint",
        default=0.0,
    )
    law: str | None = optional_key(
        choice(LAWS), "", "law of a driven joint, with turn_deg and over"
    )
    turn_deg: float | None = optional_key(finite, "deg", "turn of that law")
    over: float | None = optional_key(TIME, "s", "duration of that law [the whole motion]")
    expression: str | None = optional_key(
        text, "", "instead: angle [rad] or torque [N m] of t [s], such as 0.5*sin(2*pi*t)"
    )
    csv: str | None = optional_key(
        text, "", "instead: a file with columns time [s] and angle or torque"
    )
    times: tuple[float, ...] = key(numbers(), "s", "instead: times of a table", default=())
    values: tuple[float, ...] = key(
        numbers(), "rad or N m", "angle or torque at these times", default=()
    )
    breakpoints: tuple[float, ...] = key(
        numbers(), "s", "times at which an expression or its derivative jumps", default=()
    )
    lock_time: float | None = optional_key(TIME, "s", "when the joint locks at its current angle")
    latch_deg: float | None = optional_key(
        finite, "deg", "angle at which a latch catches the joint"
    )

    def __post_init__(self) -> None:
        check(self, "joint.")

    @property
    def start(self) -> float:
        """Given angle at the start [rad]; 0 if there is none."""
        return math.radians(self.start_deg or 0.0)

    def check_kind(self, name: str) -> None:
        """Raise StudyError unless the keys of the joint fit its kind."""
        self._check_drive(name)
        self._check_law(name)
        self._check_lock(name)

    def _check_drive(self, name: str) -> None:
        """A driven joint has one law; other joints have none."""
        ways = {
            "law": self.law is not None,
            "expression": self.expression is not None,
            "csv": self.csv is not None,
            "times and values": bool(self.times or self.values),
        }
        stated = [way for way, given in ways.items() if given]
        driven = self.kind in ("angle", "torque")

        if driven and len(stated) != 1:
            which = " and ".join(stated) or "nothing"
            raise StudyError(
                f"{name} is driven by {self.kind}, but its law is given by {which}; give one of "
                f"{', '.join(ways)}"
            )
        if not driven and stated:
            raise StudyError(
                f'{name} is {self.kind}, but has {stated[0]}; give kind = "angle" '
                'or "torque", or leave it out'
            )

    def _check_law(self, name: str) -> None:
        """A law has a turn, and its kind matches the kind of its joint."""
        if self.law is not None and self.turn_deg in (None, 0.0):
            raise StudyError(
                f"{name} follows the law {self.law}, but its turn is zero or missing; give turn_deg"
            )
        if self.kind == "angle" and self.law == "linear":
            raise StudyError(
                f'{name}: the law linear applies only to a torque; give kind = "torque"'
            )

        if self.kind in ("locked", "angle") and self.start_rate:
            raise StudyError(
                f"{name} is {self.kind}, so its initial rate is fixed; remove start_rate"
            )

    def _check_lock(self, name: str) -> None:
        """A joint that locks later moves before, and one with a latch is free to reach it."""
        if self.latch_deg is not None and self.latch_deg == (self.start_deg or 0.0):
            raise StudyError(
                f"{name} starts at its latch, {self.latch_deg:g} deg; give another start_deg, or "
                'kind = "locked"'
            )
        if self.kind == "locked" and (self.lock_time or self.latch_deg is not None):
            raise StudyError(f"{name} is already locked; remove lock_time and latch_deg")
        if self.kind == "angle" and self.latch_deg is not None:
            raise StudyError(f"{name} follows an angle, so it cannot have a latch; give lock_time")


@dataclass(frozen=True, kw_only=True)
class SweepCase:
    """Multiples of the case, the table `[sweep]`; one quantity is changed at a time."""

    speed: tuple[float, ...] = key(
        numbers(), "", "factors of the speed: durations are divided by them", default=(), flags=()
    )
    length: tuple[float, ...] = key(
        numbers(), "", "factors of the lengths of all links", default=(), flags=()
    )
    modulus: tuple[float, ...] = key(
        numbers(), "", "factors of all Young's moduli", default=(), flags=()
    )

    def __post_init__(self) -> None:
        check(self, "sweep.")
        for name in SWEEPS:
            for value in getattr(self, name):
                FACTOR(f"sweep.{name}", value)


@dataclass(frozen=True, kw_only=True)
class FlexStudy:
    """A chain of flexible links and its motion: `antenna-ocp flex`.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    duration: float = key(TIME, "s", "of the motion")
    link: tuple[LinkCase, ...] = key(
        tables(LinkCase), "", "the links, from the root outward", flags=()
    )
    joint: tuple[JointCase, ...] = key(
        tables(JointCase), "", "the joints, one at the start of each link", flags=()
    )
    material: Mapping[str, MaterialCase] = key(
        named_tables(MaterialCase), "", "materials by name", factory=dict, flags=()
    )
    gravity: tuple[float, ...] = key(
        numbers(2, 2),
        "m/s^2",
        "acceleration of gravity along x and y",
        default=(0.0, 0.0),
        flags=(Flag("--gravity", metavar="X,Y", read=numbers_with_commas),),
    )
    hub_inertia: float = key(
        limited(not_negative),
        "kg m^2",
        "inertia that turns with the first link's start",
        default=0.0,
    )
    damping_ratio: float = key(
        not_negative,
        "",
        "internal damping ratio at damping_frequency",
        default=0.0,
    )
    damping_frequency: float = key(
        positive, "Hz", "frequency at which damping_ratio applies", default=1.0
    )
    elements: int = key(whole(1, 64), "", "elements of each link", default=8)
    form: str = key(
        choice(FORMS),
        "",
        "constraints eliminated (minimal), kept with multipliers as in (14) (index-1), or both to "
        "compare",
        default="minimal",
    )
    stabilisation: float = key(
        not_negative, "1/s", "alpha = beta of (14) for index-1", default=20.0
    )
    tolerance: float = key(positive, "m", "maximum local error of a step", default=1e-7)
    step: float | None = optional_key(
        positive,
        "s",
        "fixed step instead, required if a torque jumps: it damps modes that it cannot resolve",
    )
    samples: int = key(whole(11, 100_000), "", "number of even output times", default=1001)
    frequencies: int = key(whole(0, 20), "", "number of natural frequencies to list", default=4)
    pace: float = key(
        FACTOR,
        "",
        "multiple of the speed: all times are divided by it, torques of laws multiplied by its "
        "square",
        default=1.0,
    )
    mesh_check: bool = key(
        boolean,
        "",
        "also with half the elements, to estimate the error of the mesh",
        default=False,
    )
    sweep: SweepCase = key(section(SweepCase), "", "variants of the case", factory=SweepCase)

    def __post_init__(self) -> None:
        check(self)
        if len(self.joint) > len(self.link):
            raise StudyError(
                f"joint[{len(self.link)}] has no link: there are {len(self.joint)} joints and "
                f"{len(self.link)} link(s); give a joint at the start of each link"
            )
        if len(self.joint) < len(self.link):
            raise StudyError(
                f"link[{len(self.joint)}] has no joint: there are {len(self.joint)} joint(s) and "
                f"{len(self.link)} links; give a joint at the start of each link"
            )
        for i, joint in enumerate(self.joint):
            joint.check_kind(f"joint[{i}]")
            if joint.lock_time is not None and joint.lock_time > self.duration:
                raise StudyError(
                    f"joint[{i}].lock_time is {joint.lock_time:g} s, after the motion's "
                    f"{self.duration:g} s; reduce it, or increase the duration"
                )
        assert self.links  # made once here, so that an impossible link raises its error early

    @cached_property
    def links(self) -> tuple[Link, ...]:
        """The links of the models."""
        return tuple(self._link(f"link[{i}]", link) for i, link in enumerate(self.link))

    def _link(self, name: str, link: LinkCase) -> Link:
        area, second_moment = link.section_of(name)
        modulus, density = self._material(name, link)
        try:
            return Link.from_section(
                link.length,
                area=area,
                second_moment=second_moment,
                modulus=modulus,
                density=density,
            )
        except ModelError as error:
            raise StudyError(f"{name}: {error}") from error

    def _material(self, name: str, link: LinkCase) -> tuple[float, float]:
        """Modulus [Pa] and density [kg/m^3] of a link."""
        if link.material is None:
            if link.modulus is None or link.density is None:
                raise StudyError(f"{name} has no material; give material, or modulus and density")
            return link.modulus, link.density
        if link.modulus is not None or link.density is not None:
            raise StudyError(
                f"{name} has both a material and a modulus or density; give one of them"
            )
        if link.material not in self.material:
            known = ", ".join(self.material) or "none"
            raise StudyError(
                f"{name}.material is {quoted(link.material)}, but the known materials are "
                f"{known}; add a table [material.{link.material}]"
            )
        material = self.material[link.material]
        return material.modulus, material.density

    @property
    def time(self) -> float:
        """Duration at this pace [s]."""
        return self.duration / self.pace

    @property
    def forms(self) -> tuple[Form, ...]:
        """The forms of the equations to run."""
        return ("minimal", "index-1") if self.form == "both" else (self.form,)  # type: ignore[return-value]

    @property
    def question(self) -> str:
        """The question, in one line."""
        kinds = ", ".join(joint.kind for joint in self.joint)
        if len(self.link) == 1:
            return f"1 flexible link in {self.time:g} s, joint {kinds}: how does it move?"
        many = f"{len(self.link)} flexible links"
        return f"{many} in {self.time:g} s, joints {kinds}: how do they move?"


def study_from(raw: Mapping[str, Any]) -> FlexStudy:
    """The study that a nested dictionary states; StudyError names what is wrong."""
    missing = [name for name in ("duration", "link", "joint") if name not in raw]
    if missing:
        raise StudyError(f"the case has no {missing[0]}; give one, as the examples do")
    return from_mapping(FlexStudy, raw)


def as_dictionary(study: FlexStudy) -> dict[str, Any]:
    """The nested dictionary that states the same study again."""
    return _stated(dataclasses.asdict(study))


def _stated(content: Mapping[str, Any]) -> dict[str, Any]:
    """Without the keys that are not given, as TOML has no null."""
    found: dict[str, Any] = {}
    for name, value in content.items():
        if isinstance(value, Mapping):
            value = _stated(value)
        elif isinstance(value, tuple | list) and value and isinstance(value[0], Mapping):
            value = [_stated(item) for item in value]
        if value is not None and value not in ((), {}):
            found[name] = value
    return found
