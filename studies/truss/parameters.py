"""The parameters of the truss of a result, with their sources."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from models.truss import DYNAMIC_SET, KINEMATIC_SET, JointMasses, TrussParameters
from studies.common.keys import KeyLine, key_lines
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
    for about in key_lines(TrussParameters):
        name, value = about.key, values.get(about.key)
        if name == "joint_masses" or name not in values:
            continue
        sources = [key for key, known in printed.items() if getattr(known, name) == value]
        source = f"paper, {sources[0]}" if sources else "chosen in this study"
        if name in ASSUMED and sources:
            source = "assumed; the paper gives none"
        if name in LOADS:
            stated = np.ravel(value)
            if not stated.any():
                continue  # the paper has none of it
            value, source = ", ".join(f"{one:g}" for one in stated), "chosen in this study"
        if name == "counting":
            source = "physics; the paper as printed counts twice"
        lines.append(_line(in_words(name), about, value, source))

    masses = values.get("joint_masses") or {}
    for about in key_lines(JointMasses):
        if about.key in masses:
            mass = masses[about.key]
            source = "assumed; the paper gives none" if mass == 0 else "chosen in this study"
            lines.append(_line(f"joint mass, {in_words(about.key)}", about, mass, source))

    of_arm = ("assumed, but for the paper's lengths", "chosen in this study")
    arm = stated_parameters(CarryingArm, configuration.get("arm", {}), "arm: ", of_arm)
    return [*lines, *arm]


def _line(name: str, about: KeyLine, value: Any, source: str) -> ParameterLine:
    return ParameterLine(name, about.meaning, about.unit or "-", value, source)
