"""Margins that a standard asks for, each number with where it was read.

A standard whose text, or a description of it by those who apply it, could not be read has no
preset: its factors can be stated one by one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Preset:
    """Required margins of a standard.

    Attributes
    ----------
    title : of the standard.
    static, dynamic : required margins, 1.0 is 100 %.
    source : where these two were read.
    on_factors : what the source says of uncertainty factors and derating, all of which are 1.0.
    """

    title: str
    static: float
    dynamic: float
    source: str
    on_factors: str


# of The Aerospace Corporation, https://mab.aerospace.org/lvl2/4_4_4_5_4.4.4.5-6
_BASELINE = "Mission Assurance Baseline 4.4.4.5-6-1"

PRESETS: Mapping[str, Preset] = {
    "aiaa-s-114": Preset(
        title="AIAA S-114-2005 as commonly applied",
        static=1.0,
        dynamic=0.25,
        source=f"{_BASELINE}, on AIAA S-114-2005",
        on_factors=f"{_BASELINE} states none",
    )
}
