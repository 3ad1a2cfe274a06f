"""The parameters of the arm of a result, with their sources."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from studies.arm.config import ArmDescription
from studies.common.parameters import ParameterLine, in_words


def parameters_of(configuration: Mapping[str, Any]) -> list[ParameterLine]:
    """All parameters that a configuration has of the arm."""
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
            ParameterLine(in_words(field.name), about.meaning, about.unit or "-", value, source)
        )
    return lines
