"""Pictures: nothing hides what they show, and none has a quarter of nothing."""

from types import SimpleNamespace

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

from models.truss import TrussParameters
from studies.check.figures import rows_figure
from studies.flex.figures import motion_figure
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import pinned_bezier

RESULT = {"configuration": {"link": [{}]}, "details": {"poses": {"frames": 2}}}


def test_no_legend_lies_on_the_rows_of_a_file():
    truss = TrussParameters()
    law = Deployment("profile", pinned_bezier(truss, 4.0), truss)
    time = np.linspace(0.0, 4.0, 9)
    columns = {"rows/time": time, "rows/angle": law.law.motion(time).angle}
    figure = rows_figure(SimpleNamespace(details={"noise": {"matters": True}}), law, columns)
    FigureCanvasAgg(figure).draw()
    for panel in figure.axes:
        assert panel.get_legend().get_window_extent().y1 < panel.get_window_extent().y0


def test_the_page_of_a_chain_has_its_shape():
    shares = []
    for width, height in ((1.0, 2.0), (2.0, 2.0), (2.0, 1.0)):
        x, y = np.array([[0.0, width], [0.0, 0.0]]), np.array([[0.0, 0.0], [0.0, -height]])
        values = {"pose_x": x, "pose_y": y, "pose_time": np.array([[0.0, 0.0], [1.0, 1.0]])}
        values |= {"x_0": x[:, 1], "y_0": y[:, 1]}
        arrays = {name: SimpleNamespace(values=v.ravel()) for name, v in values.items()}
        figure = motion_figure(SimpleNamespace(arrays=arrays, **RESULT))
        FigureCanvasAgg(figure).draw()
        panel, page = figure.axes[0].get_window_extent(), figure.bbox
        shares.append(panel.width * panel.height / (page.width * page.height))
    assert min(shares) > 0.4  # axes, their labels and the times take the rest
