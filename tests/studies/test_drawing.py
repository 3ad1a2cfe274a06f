"""What figures share: looks of laws, axes that show every curve, nothing cut off or made up."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from models.laws import Step5
from studies.common.drawing import LAWS, look, show_lowest, smoothest_on_top
from studies.paper.cases import DEPLOYED, WITH_FRICTION
from studies.truss.figures import tension_figure
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import pinned_bezier

T = np.linspace(0.0, 1.0, 51)
PINNED = pinned_bezier(WITH_FRICTION, 140.0)


def test_each_law_has_its_own_look_whatever_its_frequency_or_place() -> None:
    assert len({look(law) for law in LAWS}) == len(LAWS)
    assert look("ZVD 0.996 Hz") == look("ZVD") != look("ZV 0.996 Hz")
    assert look("optimal") == look("mine.csv") == look("optimum")


@pytest.mark.parametrize(("peak", "scale"), [(3.0, "linear"), (600.0, "asinh")])
def test_a_curve_that_another_one_flattens_is_shown(peak: float, scale: str) -> None:
    panel = Figure().subplots()
    panel.plot(T, 0.4 * np.sin(6 * T))
    panel.plot(T, -peak * T**40)
    panel.plot(T, 0 * T)
    panel.set_ylabel("acceleration [m/s²]")
    show_lowest(panel)
    assert panel.get_yscale() == scale
    low, high = panel.get_ylim()
    assert low < -peak
    assert high > 0.39
    forward = panel.yaxis.get_transform().transform
    ends, swing = forward([low, high]), forward([-0.4, 0.4])
    assert np.ptp(swing) > 0.1 * np.ptp(ends)
    assert all(low < tick < high for tick in panel.get_yticks()) or scale == "linear"


def test_a_curve_that_rattles_is_below_one_that_does_not() -> None:
    panel = Figure().subplots()
    (smooth,) = panel.plot(T, T)
    (rattling,) = panel.plot(T, T + 0.1 * (-1.0) ** np.arange(T.size))
    smoothest_on_top(panel)
    assert smooth.get_zorder() > rattling.get_zorder()


def test_the_tension_of_a_harsher_law_is_not_cut_off() -> None:
    fast = Step5(5.0, WITH_FRICTION.stowed_angle, DEPLOYED)
    laws = [Deployment("Bezier", PINNED, WITH_FRICTION), Deployment("Step5", fast, WITH_FRICTION)]
    for panel in tension_figure(laws).axes:
        low, high = panel.get_ylim()
        assert low == 0
        assert all(np.max(line.get_ydata()) < high for line in panel.get_lines())
