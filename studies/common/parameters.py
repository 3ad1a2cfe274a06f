"""The parameters of a result's model with meaning, unit and source, as a report lists them."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

SECTION = re.compile(r"^(?:Attributes|Parameters)\n-+\n(.*?)(?=\n\n\S[^\n]*\n-+\n|\Z)", re.M | re.S)
FIELD = re.compile(r"^(\w+(?:, \w+)*) : (.*(?:\n[ ]+.*)*)", re.M)
UNIT = re.compile(r"\s*\[([^\]]+)\]")
ASSUMED = ("linear_density", "joint_masses", "counting")  # the paper gives none of them


@dataclass(frozen=True)
class ParameterLine:
    """One parameter: what it is called, what it is, and where its value comes from."""

    name: str
    meaning: str
    unit: str
    value: Any
    source: str


def parameter_lines(subject: str, configuration: Mapping[str, Any]) -> list[ParameterLine]:
    """All parameters of the model of a study; none where its subject has none."""
    reader = _READERS.get(subject)
    return reader(configuration) if reader else []


def field_texts(kind: type) -> dict[str, str]:
    """What the docstring of a class says of each field; empty if it lists none."""
    section = SECTION.search(inspect.getdoc(kind) or "")
    texts: dict[str, str] = {}
    for names, body in FIELD.findall(section[1] if section else ""):
        lines = [line.strip() for line in body.split("\n")]
        if len(lines) > 1 and re.fullmatch(r"[A-Z]?\w+", lines[0]):
            lines = lines[1:]  # "name : type" with the meaning below
        texts |= dict.fromkeys(names.split(", "), " ".join(lines))
    return texts


def _of_the_truss(configuration: Mapping[str, Any]) -> list[ParameterLine]:
    from models.truss import DYNAMIC_SET, KINEMATIC_SET, JointMasses, TrussParameters

    values = configuration.get("truss", {})
    printed = {"dynamic set": DYNAMIC_SET, "kinematic set": KINEMATIC_SET}
    lines = []
    for name, text in field_texts(TrussParameters).items():
        if name == "joint_masses" or name not in values:
            continue
        sources = [key for key, known in printed.items() if getattr(known, name) == values[name]]
        source = f"paper, {sources[0]}" if sources else "chosen in this study"
        if name in ASSUMED and sources:
            source = "assumed; the paper gives none"
        if name == "counting":
            source = "physics; the paper as printed counts twice"
        lines.append(_line(name, text, values[name], source))

    masses = values.get("joint_masses") or {}
    for name, text in field_texts(JointMasses).items():
        if name in masses:
            source = (
                "assumed; the paper gives none" if masses[name] == 0 else "chosen in this study"
            )
            lines.append(_line(f"joint mass, {name}", text, masses[name], source))
    return lines


def _of_the_arm(configuration: Mapping[str, Any]) -> list[ParameterLine]:
    from studies.arm.config import ArmDescription

    values = configuration.get("arm", {})
    lines = []
    for field in dataclasses.fields(ArmDescription):
        about = field.metadata.get("key")
        if about is None or field.name not in values:
            continue
        value, lengths = values[field.name], ("big_length", "small_length")
        same = value == field.default
        source = "chosen in this study" if not same else "assumed; the paper gives none"
        if same and field.name in lengths:
            source = "paper"
        lines.append(
            ParameterLine(_words(field.name), about.meaning, about.unit or "-", value, source)
        )
    return lines


def _of_the_links(configuration: Mapping[str, Any]) -> list[ParameterLine]:
    from studies.flex.config import FlexStudy, JointCase, LinkCase, MaterialCase

    lines = _stated(FlexStudy, configuration, "")
    for name, material in configuration.get("material", {}).items():
        lines += _stated(MaterialCase, material, f"material {name}: ")
    for one, kind in (("link", LinkCase), ("joint", JointCase)):
        for number, values in enumerate(configuration.get(one, ())):
            lines += _stated(kind, values, f"{one} {number}: ")
    return lines


def _stated(kind: type, values: Mapping[str, Any], prefix: str) -> list[ParameterLine]:
    """What a case states of one of its tables; tables inside it are left out."""
    lines = []
    for field in dataclasses.fields(kind):
        value, about = values.get(field.name), field.metadata.get("key")
        if about is None or value is None or isinstance(value, Mapping):
            continue
        if isinstance(value, (list, tuple)):
            if not value or isinstance(value[0], Mapping):
                continue
            value = ", ".join(f"{number:g}" for number in value)
        source = "by default" if value == field.default else "stated in this case"
        name = prefix + _words(field.name)
        lines.append(ParameterLine(name, about.meaning, about.unit or "-", value, source))
    return lines


def _line(name: str, text: str, value: Any, source: str) -> ParameterLine:
    units = UNIT.findall(text)
    return ParameterLine(
        name=_words(name),
        meaning=UNIT.sub("", text, count=1).strip(" .,"),
        unit=units[0] if units else "-",
        value=value,
        source=source,
    )


def _words(name: str) -> str:
    return name.replace("_", " ")


_READERS: Mapping[str, Callable[[Mapping[str, Any]], list[ParameterLine]]] = {
    "truss": _of_the_truss,
    "arm": _of_the_arm,
    "flex": _of_the_links,
}
