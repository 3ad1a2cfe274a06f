"""A front as a result, whatever mechanism it is of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ocp import FrontPoint, ParetoFront
from ocp.arrays import Array
from studies.common.comparison_table import TableRow, costs_elsewhere
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series
from studies.fronts.columns import FrontAxis, front_details, front_series, law_series
from studies.fronts.words import checks_of_points, front_in_words, front_verdict

PROVEN = "proven: no motion is below"


def named_points(
    front: ParetoFront, axes: Sequence[FrontAxis], open_ends: Sequence[str] = ()
) -> dict[str, FrontPoint]:
    """The points of a table by their names: the knee, or one in the middle, and both ends.

    Parameters
    ----------
    open_ends : keys of the objectives whose least value no motion attains.
    """
    middle = "middle" if front.knee is None else "knee"
    ends = (
        f"{'near ' * (axis.key in open_ends)}least {axis.key.removeprefix('peak-')}"
        for axis in axes
    )
    points = front.middle, front.points[0], front.points[-1]
    return dict(zip((middle, *ends), points, strict=True))


def front_result(
    front: ParetoFront,
    axes: tuple[FrontAxis, FrontAxis],
    *,
    kind: str,
    question: str,
    configuration: Mapping[str, Any],
    bounds: Array,
    laws: Mapping[str, Sequence[Sequence[float]]],
    motions: Mapping[str, Series],
    table: tuple[TableRow, ...],
    also_found: tuple[str, ...],
    details: Mapping[str, Any],
    bound: str = PROVEN,
    least: Mapping[str, float] | None = None,
    checks: Sequence[Criterion] = (),
    remarks: Sequence[str] = (),
) -> Result:
    """The result of a front.

    Parameters
    ----------
    axes : the objective that is limited, and the one that is least.
    bounds : (points,) of what is least, nan where there is none.
    laws : places of laws beside the front, by their names.
    motions : of all points, see `columns.point_name`.
    table, also_found, remarks, details : as of a `Result`; those of every front are added.
    bound : what `bounds` says; anything else than `PROVEN` is drawn, and not checked.
    least : proven bounds of both objectives, by their keys.
    checks : besides those of every front.
    """
    return Result(
        kind=kind,
        question=question,
        configuration=configuration,
        arrays={**front_series(front, bounds, *axes), **law_series(laws, *axes), **motions},
        table=table,
        also_found=also_found,
        costs_elsewhere=costs_elsewhere(table, also_found),
        bounds=least or {},
        verdict=front_verdict(front),
        checks=(
            *checks_of_points(front, axes[1], bounds if bound == PROVEN else bounds * float("nan")),
            *checks,
        ),
        remarks=(*front_in_words(front, *axes), *remarks),
        details={**front_details(front, *axes), "bound": bound, **details},
        provenance=provenance(),
    )
