"""The parameters of the truss of a result, with their sources."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from models.truss import DYNAMIC_SET, KINEMATIC_SET, JointMasses, TrussParameters
from studies.common.keys import UNIT, field_texts
from studies.common.parameters import ParameterLine, in_words, stated_parameters
from studies.truss.carrier import CarryingArm
from studies.truss.config import LOADS

# the paper gives none of them
ASSUMED = ("linear_density", "elastic_modulus", "joint_masses", "counting")


def parameters_of(configuration: Mapping[str, Any]) -> list[ParameterLine]:
    """All parameters that a configuration has of the truss and its joints."""
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
        if name in LOADS:
            stated = np.ravel(values[name])
            if not stated.any():
                continue  # the paper has none of it
            value = ", ".join(f"{one:g}" for one in stated)
            lines.append(_line(name, text, value, "chosen in this study"))
            continue
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

    of_arm = ("assumed, but for the paper's lengths", "chosen in this study")
    arm = stated_parameters(CarryingArm, configuration.get("arm", {}), "arm: ", of_arm)
    return [*lines, *arm]


def _line(name: str, text: str, value: Any, source: str) -> ParameterLine:
    units = UNIT.findall(text)
    return ParameterLine(
        name=in_words(name),
        meaning=UNIT.sub("", text, count=1).strip(" .,"),
        unit=units[0] if units else "-",
        value=value,
        source=source,
    )
