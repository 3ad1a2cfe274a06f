"""The parameters of the arm of a result, with their sources."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from studies.common.arm_description import ArmDescription
from studies.common.parameters import ParameterLine, stated_parameters

ASSUMED = "assumed; the paper gives none"
PRINTED = ("big length", "small length")


def parameters_of(configuration: Mapping[str, Any]) -> list[ParameterLine]:
    """All parameters that a configuration has of the arm."""
    sources = (ASSUMED, "chosen in this study")
    lines = stated_parameters(ArmDescription, configuration.get("arm", {}), sources=sources)
    return [
        replace(line, source="paper") if line.name in PRINTED and line.source == ASSUMED else line
        for line in lines
    ]
