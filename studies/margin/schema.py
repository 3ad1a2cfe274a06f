"""Margins as the user states them: `[margin]` in the TOML file of a study, or a file of its own."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from models.errors import ModelError
from studies.common.configuration import (
    as_stated,
    boolean,
    check,
    check_keys,
    choice,
    from_mapping,
    key,
    not_negative,
    optional_key,
    positive,
    read_toml,
    section,
    table,
)
from studies.common.exit_codes import StudyError, quoted
from studies.margin.presets import PRESETS

if TYPE_CHECKING:  # CasADi loads with them, and not for a table of keys
    from models.truss import TrussParameters
    from models.truss.measured import Curve

# parameters of the truss that a load case may change: those that leave its geometry alone
OF_A_CASE = (
    "spring_stiffness",
    "spring_free_length",
    "net_stiffness",
    "joint_friction",
    "slider_friction",
    "pulley_friction",
    "joint_coulomb",
    "slider_coulomb",
    "off_load",
    "off_load_friction",
    "linear_density",
)


def _at_least_one(name: str, value: Any) -> float:
    """An uncertainty factor."""
    factor = positive(name, value)
    if factor < 1.0:
        raise StudyError(
            f"{name} is {factor:g}; an uncertainty factor must not reduce a load: give at least 1"
        )
    return factor


def _at_most_one(name: str, value: Any) -> float:
    """A derating."""
    part = positive(name, value)
    if part > 1.0:
        raise StudyError(
            f"{name} is {part:g}; a derating factor is a fraction of the force of the motor: give "
            "at most 1"
        )
    return part


@dataclass(frozen=True, kw_only=True)
class Factors:
    """Uncertainty factors, each on one contribution to the force, at least 1.

    A contribution that helps the motor, as inertia does while it brakes, is not multiplied.

    Attributes
    ----------
    inertia : of the truss's bars.
    springs, net : of the springs and the cable net.
    joint_friction, slider_friction : viscous, of joints and sliders.
    pulley_friction : of the rope on its pulleys; it grows with the factored tension.
    coulomb_friction : Coulomb's, of joints and sliders.
    test_bench : of the weight that is left, and of the friction of the off-load.
    holding : of the constant force `MarginRequirements.holding`.
    measured : of the measured curve `MarginRequirements.resistance`.
    rotor : of the inertia of the motor's rotor.
    """

    inertia: float = key(_at_least_one, "", "on the force that moves the bars", default=1.0)
    springs: float = key(_at_least_one, "", "on the springs", default=1.0)
    net: float = key(_at_least_one, "", "on the cable net", default=1.0)
    joint_friction: float = key(_at_least_one, "", "on the joints' friction", default=1.0)
    slider_friction: float = key(_at_least_one, "", "on the sliders' friction", default=1.0)
    pulley_friction: float = key(_at_least_one, "", "on the pulleys' friction", default=1.0)
    coulomb_friction: float = key(
        _at_least_one, "", "on the Coulomb friction of joints and sliders", default=1.0
    )
    test_bench: float = key(
        _at_least_one, "", "on the weight on a test bench and its off-load's friction", default=1.0
    )
    holding: float = key(_at_least_one, "", "on the holding force", default=1.0)
    measured: float = key(_at_least_one, "", "on the measured resistance", default=1.0)
    rotor: float = key(_at_least_one, "", "on the inertia of the motor's rotor", default=1.0)

    def __post_init__(self) -> None:
        check(self, "margin.factors.")


@dataclass(frozen=True, kw_only=True)
class Derating:
    """Parts that are left of what the motor can do, each at most 1.

    Attributes
    ----------
    voltage, temperature, ageing : what reduces it.
    """

    voltage: float = key(_at_most_one, "", "left at the lowest voltage", default=1.0)
    temperature: float = key(_at_most_one, "", "left at the worst temperature", default=1.0)
    ageing: float = key(_at_most_one, "", "left at the end of life", default=1.0)

    def __post_init__(self) -> None:
        check(self, "margin.derating.")

    @property
    def whole(self) -> float:
        """What is left after all of them."""
        return self.voltage * self.temperature * self.ageing


@dataclass(frozen=True)
class LoadCase:
    """One environment, such as cold or end of life.

    Attributes
    ----------
    name : of the case.
    truss : as it is then.
    factors, derating : as they are then.
    holding : constant resisting force on each rope [N].
    changed : whether the truss is another one than that of the study.
    """

    name: str
    truss: TrussParameters
    factors: Factors
    derating: Derating
    holding: float
    changed: bool


def _cases(name: str, value: Any) -> tuple[tuple[str, tuple[tuple[str, Any], ...]], ...]:
    """Tables of a case each, as tuples that can be compared and hashed."""
    found = []
    stated = dict(value) if isinstance(value, tuple) else table(name, value)
    for case, content in stated.items():
        raw = dict(content) if isinstance(content, tuple) else table(f"{name}.{case}", content)
        check_keys(raw, ["factors", "derating", "holding", *OF_A_CASE], f"{name}.{case}.")
        for part, kind in (("factors", Factors), ("derating", Derating)):
            inner = dict(raw.get(part, {}))
            from_mapping(kind, inner, f"{name}.{case}.{part}.")
            if inner:
                raw = {**raw, part: tuple(sorted(inner.items()))}
        for parameter in (*OF_A_CASE, "holding"):
            if parameter in raw:
                not_negative(f"{name}.{case}.{parameter}", raw[parameter])
        found.append((str(case), tuple(sorted(raw.items()))))
    return tuple(found)


def _curve(name: str, value: Any) -> Curve:
    """A measured curve of resistance; see `curve_of`."""
    from studies.margin.resistance import curve_of

    return curve_of(name, value)


@dataclass(frozen=True, kw_only=True)
class MarginRequirements:
    """Margins that are asked for.

    Attributes
    ----------
    preset : name of a standard; its numbers hold where none are stated.
    static, dynamic : required margins of the available force over the required one, at rest and in
        motion, 1.0 is 100 %.
    keep : whether motions have to keep the margins; else a result only says whether it does.
    available : force that the motor has for each rope [N]; by default what the drive can do.
    factors, derating : in every load case, unless it states its own.
    holding : constant resisting force on each rope, as of a harness [N].
    resistance : measured torque against the deployment angle, (angle, torque) [rad, N m].
    cases : tables of load cases by name, with `factors`, `derating`, `holding` and parameters of
        the truss; the worst of them governs. Without any there is one, as the study states it.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    preset: str | None = optional_key(choice(PRESETS), "", f"one of {', '.join(PRESETS)}")
    static: float | None = optional_key(
        not_negative, "", "required margin at rest, 1.0 is 100 %; none: that of the preset, or 0"
    )
    dynamic: float | None = optional_key(
        not_negative, "", "required margin in motion; none: that of the preset, or 0"
    )
    keep: bool = key(
        boolean, "", "whether the motion must keep the margins, like its caps", default=False
    )
    available: float | None = optional_key(
        positive, "N", "force of the motor for each rope; none: the force that the drive supplies"
    )
    factors: Factors = key(section(Factors), "", "uncertainty factors", factory=Factors)
    derating: Derating = key(section(Derating), "", "of the motor", factory=Derating)
    holding: float = key(not_negative, "N", "constant resisting force on each rope", default=0.0)
    resistance: Curve | None = optional_key(
        _curve,
        "rad, N m",
        "measured rows [angle, torque] along the travel, or the name of a CSV file of them",
    )
    cases: Any = key(
        _cases,
        "",
        f"tables of load cases, each with factors, derating, holding, {', '.join(OF_A_CASE)}",
        default=(),
    )

    def __post_init__(self) -> None:
        check(self, "margin.")

    @property
    def required(self) -> tuple[float, float]:
        """Static and dynamic margin that are asked for."""
        preset = None if self.preset is None else PRESETS[self.preset]
        stated = (self.static, self.dynamic)
        by_default = (0.0, 0.0) if preset is None else (preset.static, preset.dynamic)
        static, dynamic = (
            default if own is None else own for own, default in zip(stated, by_default, strict=True)
        )
        return static, dynamic

    def load_cases(self, truss: TrussParameters) -> tuple[LoadCase, ...]:
        """The cases on a truss; one, "as stated", where none are named.

        Raises
        ------
        StudyError
            If a parameter of a case makes no truss.
        """
        from models.truss import TrussParameters, with_symbols

        if not self.cases:
            return (LoadCase("as stated", truss, self.factors, self.derating, self.holding, False),)
        found = []
        for name, content in self.cases:
            raw = dict(content)
            changes = {parameter: raw[parameter] for parameter in OF_A_CASE if parameter in raw}
            known = isinstance(truss, TrussParameters)
            try:
                # a stand-in with unknown parameters is no dataclass, and is checked by its study
                changed = (dataclasses.replace if known else with_symbols)(truss, **changes)
            except ModelError as error:
                raise StudyError(f"margin.cases.{name}: {error}") from error
            factors = dataclasses.replace(self.factors, **dict(raw.get("factors", ())))
            derating = dataclasses.replace(self.derating, **dict(raw.get("derating", ())))
            holding = float(raw.get("holding", self.holding))
            found.append(LoadCase(name, changed, factors, derating, holding, bool(changes)))
        return tuple(found)

    def sources(self) -> list[dict[str, Any]]:
        """Every number that is asked for, with where it comes from."""
        preset = None if self.preset is None else PRESETS[self.preset]
        lines: list[dict[str, Any]] = []
        for place, name in enumerate(("static", "dynamic")):
            own = getattr(self, name) is not None or preset is None
            source = "stated" if own or preset is None else preset.source
            value = self.required[place]
            lines.append({"number": f"{name} margin", "value": value, "source": source})
        for title, part in (("factor on", self.factors), ("derating", self.derating)):
            for field in dataclasses.fields(part):
                value = getattr(part, field.name)
                source = preset.on_factors if preset is not None and value == 1.0 else "stated"
                if preset is None and value == 1.0:
                    source = "1.0 by default"
                words = f"{title} {field.name.replace('_', ' ')}"
                lines.append({"number": words, "value": value, "source": source})
        return lines

    def as_dictionary(self) -> dict[str, Any]:
        """What is stated, as TOML holds it."""
        stated = as_stated(self)
        if self.resistance is not None:
            stated["resistance"] = [list(row) for row in self.resistance]
        cases = {
            name: {word: dict(part) if isinstance(part, tuple) else part for word, part in content}
            for name, content in stated.pop("cases")
        }
        return stated | ({"cases": cases} if cases else {})


def read_margin(stated: str) -> dict[str, Any]:
    """What `--margin` states: the name of a preset, or a TOML file with a table `[margin]`.

    Raises
    ------
    StudyError
        If it is neither.
    """
    if stated in PRESETS:
        return {"preset": stated}
    path = Path(stated)
    if not path.suffix and not path.exists():
        raise StudyError(
            f"--margin is {quoted(stated)}, which is neither a preset nor a file; use a preset "
            f"({', '.join(PRESETS)}), or give the factors in a TOML file"
        )
    raw = read_toml(path)
    return dict(table("margin", raw["margin"]) if "margin" in raw else raw)
