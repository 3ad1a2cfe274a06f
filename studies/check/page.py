"""What a report shows of a checked profile of the truss: also the optimum of its own."""

from __future__ import annotations

from studies.check.figures import deployments_of
from studies.common.charts import Chart
from studies.common.result import Result
from studies.common.scene.moving_picture import MovingPicture
from studies.truss import scene as ring
from studies.truss.config import study_from
from studies.truss.motions.deployment import Deployment


def charts(result: Result) -> tuple[Chart, ...]:
    """All curves of the profile, the optimum and the paper's laws."""
    return ring.charts_of(result, _deployments(result))


def scene(result: Result) -> MovingPicture:
    """The antenna, and how each of them moves it."""
    return ring.moving_antenna(_deployments(result))


def _deployments(result: Result) -> list[Deployment]:
    columns = {name: series.values for name, series in result.arrays.items()}
    return deployments_of(result, study_from(result.configuration), columns)
