"""Ropes on which the truss would snap through are refused before any work."""

from __future__ import annotations

import math

from models.truss import Opening, TrussParameters, least_rope_stiffness
from studies.common.exit_codes import StudyError
from studies.common.rounding import up
from studies.drive.schema import Drive

MORE = 1.001  # of the least stiffness, which a remedy asks for


def check_rope(truss: TrussParameters, drive: Drive | None, opening: Opening | None = None) -> None:
    """Refuse a rope on which the truss snaps through in a motion, by default all of it.

    Raises
    ------
    StudyError
        With the stiffness to ask for.
    """
    if drive is None or drive.rope_stiffness is None:
        return
    least = least_rope_stiffness(truss, drive.rope_yields, opening)
    if drive.rope_stiffness <= least.stiffness:
        raise StudyError(
            f"drive.rope_stiffness is {drive.rope_stiffness:g} N/m, but below "
            f"{least.stiffness:.4g} N/m the truss snaps through after the ridge of its force, at "
            f"{math.degrees(least.angle):.4g} deg at the latest; give at least "
            f"{up(MORE * least.stiffness, 4)} N/m"
        )
