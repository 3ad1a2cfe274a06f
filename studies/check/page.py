"""What a report shows of a checked profile of the truss: also the optimum of its own."""

from __future__ import annotations

from studies.check.figures import deployments_of
from studies.common.charts import Chart
from studies.common.result import Result
from studies.common.scene.moving_picture import MovingPicture
from studies.truss import scene as ring


def charts(result: Result) -> tuple[Chart, ...]:
    """All curves of the profile, the optimum and the paper's laws."""
    return ring.charts_of(result, deployments_of(result))


def scene(result: Result) -> MovingPicture:
    """The antenna, and how each of them moves it."""
    return ring.moving_antenna(deployments_of(result))
