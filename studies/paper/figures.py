"""The paper's figures, drawn again from a result: 6, 10 to 20, each under its own parameter set.

The curves of the flexible models come from the result's arrays. The laws of the truss are in
closed form, so that its figures are drawn from the configuration.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from models.truss import DYNAMIC_SET, TrussParameters
from ocp.arrays import Array
from studies.common.drawing import COLOURS, SHADES, label_axes
from studies.common.result import Result
from studies.paper.cases import FRICTIONS, PENDULUM_ELEMENTS, Cases
from studies.paper.config import PaperStudy
from studies.truss import figures as truss_figures
from studies.truss.motions.deployment import Deployment

LOCKS = {"big": 86.0, "small": 112.0}  # [s]
NAMES = {"big": "Big arm, 90° in 86 s", "small": "Small arm, 180° in 112 s"}
KINEMATIC = "kinematic set, b = 0.5 m"
DYNAMIC = "dynamic set, b = 0.45 m"


def draw(result: Result) -> Iterator[tuple[str, Figure]]:
    """Every figure of a result with the name of its file."""
    cases = Cases(PaperStudy(**result.configuration))
    yield "fig06_pendulums", pendulum_figure(result)
    yield "fig10_torques", torque_figure(result)
    for name, make in (
        ("fig11_angle", truss_figures.angle_figure),
        ("fig12_rope", truss_figures.rope_figure),
        ("fig13_bars", truss_figures.bars_figure),
    ):
        deployments = cases.kinematic[:1] if name == "fig13_bars" else cases.kinematic
        yield name, named(make(deployments), KINEMATIC)
    yield "fig14_opening", named(truss_figures.snapshots_figure(cases.kinematic[0]), KINEMATIC)
    yield "fig15_big_arm", big_arm_figure(result)
    yield "fig16_small_arm", small_arm_figure(result)
    for name, deployment in (
        ("fig17_energy_without_friction", cases.dynamic[0]),
        ("fig18_energy_with_friction", cases.rubbing[0]),
    ):
        yield name, named(truss_figures.energy_figure([deployment]), DYNAMIC)
    yield "fig19_motor_force", force_figure(cases)
    yield "fig20_segment_tensions", named(truss_figures.tension_figure(cases.rubbing[:1]), DYNAMIC)


def named(figure: Figure, truss_set: str) -> Figure:
    """A figure whose title says which of the paper's two trusses it is of."""
    figure.suptitle(f"{figure.get_suptitle()} ({truss_set})", fontsize=11)
    return figure


def _panels(count: int, title: str, width: float = 4.6) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(width * count, 3.6), dpi=150, layout="constrained")
    figure.suptitle(title, fontsize=11)
    return figure, list(figure.subplots(1, count, squeeze=False)[0])


def _series(result: Result, name: str) -> tuple[Array, Array]:
    """Times and values of a series of the result."""
    series = result.arrays[name]
    return result.arrays[series.axis].values, series.values


def pendulum_figure(result: Result) -> Figure:
    """Fig. 6: height of the tips of both pendulums, on two meshes; the paper has Abaqus, too."""
    figure, panels = _panels(
        2,
        "Height of the tip, released from the horizontal (Table 1), on two meshes; without Abaqus",
    )
    for panel, name in zip(panels, ("single", "double"), strict=True):
        for elements, colour, style in zip(PENDULUM_ELEMENTS, COLOURS, ("-", "--"), strict=False):
            label = f"{elements} ANCF elements a link"
            panel.plot(
                *_series(result, f"{name}_y_{elements}"), color=colour, ls=style, label=label
            )
        panel.set_title(f"{name} pendulum", fontsize=10)
        label_axes(panel, "time [s]", "y [m]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False, fontsize=9)
    return figure


def torque_figure(result: Result) -> Figure:
    """Fig. 10: the linear torque of both arms, which ends with the lock."""
    figure, panels = _panels(2, "Torque of the driven joint; zero after the lock (our arm)")
    for panel, (name, title) in zip(panels, NAMES.items(), strict=True):
        t, torque = _series(result, f"{name}_arm_torque")
        until = slice(0, int(np.searchsorted(t, LOCKS[name])) + 1)  # the lock has two rows
        panel.plot(t[until], torque[until], color=COLOURS[0])
        panel.axhline(0.0, color="0.7", lw=0.6)
        panel.set_title(title, fontsize=10)
        label_axes(panel, "time [s]", "torque [N m]")
    return figure


def _arm_panel(result: Result, panel: Axes, series: str, label: str) -> None:
    """A curve of an arm against time, with its lock."""
    name = series.split("_")[0]
    t, values = _series(result, series)
    panel.plot(t, values, color=COLOURS[0], lw=1.0)
    panel.axvline(LOCKS[name], color=COLOURS[1], lw=0.8, ls=":", label="lock")
    panel.legend(frameon=False, fontsize=8)
    label_axes(panel, "time [s]", label)


def _zoom(result: Result, panel: Axes, series: str, label: str) -> None:
    """A curve after the lock, in millimetres."""
    t, values = _series(result, series)
    shown = t >= LOCKS[series.split("_")[0]]
    panel.plot(t[shown], 1e3 * values[shown], color=COLOURS[0], lw=0.8)
    panel.set_title("after the lock", fontsize=10)
    label_axes(panel, "time [s]", label)


def big_arm_figure(result: Result) -> Figure:
    """Fig. 15: y and speed along x of the big arm's end, and what is left after the lock."""
    figure, panels = _panels(3, f"{NAMES['big']}: its end (our arm, linear torque)")
    _arm_panel(result, panels[0], "big_arm_elbow_y", "y [m]")
    _arm_panel(result, panels[1], "big_arm_elbow_x_speed", "speed along x [m/s]")
    _zoom(result, panels[2], "big_arm_elbow_x", "x [mm]")
    return figure


def small_arm_figure(result: Result) -> Figure:
    """Fig. 16: the small arm's end, and the drift of the big arm's."""
    figure = Figure(figsize=(9.2, 6.4), dpi=150, layout="constrained")
    figure.suptitle(f"{NAMES['small']}: its end, and the big arm's (our arm)", fontsize=11)
    panels = list(figure.subplots(2, 2).ravel())
    _arm_panel(result, panels[0], "small_arm_tip_y", "y of the small arm's end [m]")
    _arm_panel(result, panels[1], "small_arm_tip_x_speed", "its speed along x [m/s]")
    _arm_panel(result, panels[2], "small_arm_tip_x", "its x [m]")
    t, drift = _series(result, "small_arm_elbow_x")
    panels[3].plot(t, 1e3 * drift, color=COLOURS[0], lw=0.8)
    panels[3].axvline(LOCKS["small"], color=COLOURS[1], lw=0.8, ls=":", label="lock")
    panels[3].legend(frameon=False, fontsize=8)
    label_axes(panels[3], "time [s]", "x of the big arm's end [mm]")
    return figure


def force_figure(cases: Cases) -> Figure:
    """Fig. 19: motor force under the Bezier law for several frictions, with start, peak and end."""
    figure, panels = _panels(2, f"Motor force on each rope, Bezier law ({DYNAMIC})", width=5.4)
    for mu, shade in zip(FRICTIONS, SHADES, strict=True):
        deployment = cases.laws(_rubbing(mu))[0]
        t = truss_figures.times(deployment)
        motion, history = deployment.at(t)
        for panel, along in zip(panels, (t, np.degrees(motion.angle)), strict=True):
            panel.plot(along, history.rope_force, color=shade, label=f"μ = {mu:g}")
        _mark(panels, deployment, shade)
    for panel, axis in zip(panels, ("time [s]", "angle α [deg]"), strict=True):
        panel.legend(frameon=False, fontsize=8)
        label_axes(panel, axis, "motor force [N]")
        panel.set_ylim(bottom=0.0)
    return figure


def _rubbing(mu: float) -> TrussParameters:
    return dataclasses.replace(DYNAMIC_SET, pulley_friction=mu)


def _mark(panels: Sequence[Axes], deployment: Deployment, colour: str) -> None:
    """A dot at the start, at the peak and at the end."""
    moments = np.array([0.0, deployment.extremes["peak-force"].time, deployment.law.duration])
    motion, history = deployment.at(moments)
    for panel, along in zip(panels, (moments, np.degrees(motion.angle)), strict=True):
        panel.plot(along, history.rope_force, "o", ms=3.5, color=colour)
