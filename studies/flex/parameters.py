"""The parameters of a chain of links of a result, with their sources."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from studies.common.parameters import ParameterLine, in_words
from studies.flex.config import FlexStudy, JointCase, LinkCase, MaterialCase


def parameters_of(configuration: Mapping[str, Any]) -> list[ParameterLine]:
    """All parameters that a case states, table by table."""
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
        name = prefix + in_words(field.name)
        lines.append(ParameterLine(name, about.meaning, about.unit or "-", value, source))
    return lines
