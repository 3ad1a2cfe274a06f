"""The parameters of a chain of links of a result, with their sources."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from studies.common.parameters import ParameterLine, stated_parameters
from studies.flex.config import FlexStudy, JointCase, LinkCase, MaterialCase


def parameters_of(configuration: Mapping[str, Any]) -> list[ParameterLine]:
    """All parameters that a case states, table by table."""
    lines = stated_parameters(FlexStudy, configuration)
    for name, material in configuration.get("material", {}).items():
        lines += stated_parameters(MaterialCase, material, f"material {name}: ")
    for one, kind in (("link", LinkCase), ("joint", JointCase)):
        for number, values in enumerate(configuration.get(one, ())):
            lines += stated_parameters(kind, values, f"{one} {number}: ")
    return lines
