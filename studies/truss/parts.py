"""What a question of its own adds to the result of a deployment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from studies.common.result import Criterion, Series


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of a result, as of margins, bars or ropes that give; all are empty if none is asked.

    Attributes
    ----------
    checks : what the motion is held against.
    sentences : what was found, and what the model leaves out.
    arrays : columns beside the profile, along its own rows.
    details : the same as numbers.
    """

    checks: tuple[Criterion, ...] = ()
    sentences: tuple[str, ...] = ()
    arrays: Mapping[str, Series] = field(default_factory=dict)
    details: Mapping[str, Any] = field(default_factory=dict)
