"""Figures after 11-14 and 17-20 of the paper, each with all laws, and a study in one picture.

A function takes deployments and returns a `Figure`; nothing is shown and no global state used.
`draw` takes a result, so that one that was stored is drawn again without solving.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from typing import Any

import casadi as ca
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from models.truss import TrussParameters, node_position, static_peak, tension_ratios
from ocp.arrays import Array
from studies.common.drawing import SHADES, label_axes, legend_below, look, show_lowest
from studies.common.exit_codes import StudyError
from studies.common.result import Result
from studies.truss.config import study_from
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import paper_laws, stored_law

POINTS = 1201
MU_SWEEP = (0.0, 0.25, 0.5, 1.0)  # of the truss's own pulley friction
PAPER_MU = 0.01  # for the sweep where the truss has none
WIDTHS = (3.4, 2.6, 1.8, 1.0)  # of lines that may cover one another, lowest first
BARS = (1, 4, 8, 12)  # the vertical bars of Fig. 13
SNAPSHOTS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)  # of the duration, in Fig. 14
OVERVIEW_SNAPSHOTS = (0.0, 0.4, 0.6, 1.0)

# rods between the nodes of a module
VERTICAL = ((1, 2), (4, 5))
CROSS_BARS = ((2, 3), (3, 4), (5, 6), (6, 1))
LINKS = ((7, 8), (9, 10), (11, 12), (13, 14))
KINDS = (  # rods, colour, width, name
    (VERTICAL, "#0b5fa5", 1.3, "vertical bars"),
    (CROSS_BARS, "#d1495b", 0.8, "cross-bars"),
    (LINKS, "#5a8f29", 0.8, "links"),
)


def draw(result: Result) -> Iterator[tuple[str, Figure]]:
    """Every figure of a result with the name of its file."""
    yield from all_figures(deployments_of(result))


def deployments_of(result: Result) -> list[Deployment]:
    """The law of a result and the paper's laws, on the truss of its study.

    Raises
    ------
    StudyError
        If the result has no profile.
    """
    columns = {name: series.values for name, series in result.arrays.items()}
    if "angle" not in columns:
        raise StudyError("the result has no profile to draw; run its study again")
    truss, law = study_from(result.configuration).truss, stored_law(columns)
    return [Deployment(result.laws[0], law, truss), *paper_laws(truss, law.duration)]


def all_figures(deployments: Sequence[Deployment]) -> Iterator[tuple[str, Figure]]:
    """Every figure with the name of its file."""
    yield "overview", overview_figure(deployments)
    yield "fig11_angle", angle_figure(deployments)
    yield "fig12_rope", rope_figure(deployments)
    yield "fig13_bars", bars_figure(deployments)
    yield "fig14_opening", snapshots_figure(deployments[0])
    frictionless = [with_friction(deployment, 0.0) for deployment in deployments]
    yield "fig17_energy_without_friction", energy_figure(frictionless)
    if deployments[0].truss.pulley_friction > 0:
        yield "fig18_energy_with_friction", energy_figure(deployments)
    yield "fig19_motor_force", force_figure(deployments)
    yield "fig20_segment_tensions", tension_figure(deployments)


def with_friction(deployment: Deployment, mu: float) -> Deployment:
    """The same law on the same truss with pulley friction `mu`."""
    truss = dataclasses.replace(deployment.truss, pulley_friction=mu)
    return dataclasses.replace(deployment, truss=truss)


def times(deployment: Deployment) -> Array:
    """Times for a curve: even ones and those of kinks [s]."""
    even = np.linspace(0.0, deployment.law.duration, POINTS)
    return np.unique(np.concatenate([even, deployment.edges]))


def angle_figure(deployments: Sequence[Deployment]) -> Figure:
    """Fig. 11: angle, angular speed and angular acceleration against time."""
    figure, axes = _row(3, "Deployment angle, its speed and acceleration")
    for deployment, colour, style in styled(deployments):
        t = times(deployment)
        motion = deployment.law.motion(t)
        histories = (np.degrees(motion.angle), motion.speed, motion.acceleration)
        for panel, history in zip(axes, histories, strict=True):
            panel.plot(t, history, style, color=colour, label=deployment.name)
    label_times(axes, ("angle α [deg]", "angular speed [rad/s]", "angular acceleration [rad/s²]"))
    legend_below(figure, axes[0])
    return figure


def rope_figure(deployments: Sequence[Deployment]) -> Figure:
    """Fig. 12: length, contraction speed and contraction acceleration of one rope."""
    figure, axes = _row(3, "One driving rope: length, contraction speed and acceleration")
    for deployment, colour, style in styled(deployments):
        t = times(deployment)
        _, truss = deployment.at(t)
        histories = (truss.rope_length, -truss.rope_speed, -truss.rope_acceleration)
        for panel, history in zip(axes, histories, strict=True):
            panel.plot(t, history, style, color=colour, label=deployment.name)
    label_times(axes, ("length [m]", "contraction speed [m/s]", "contraction acceleration [m/s²]"))
    legend_below(figure, axes[0])
    return figure


def bars_figure(deployments: Sequence[Deployment]) -> Figure:
    """Fig. 13: distance of vertical bars from the fixed one, its speed and acceleration."""
    figure, axes = _row(
        3, "Vertical bars: distance from the fixed bar 1, its speed and acceleration"
    )
    modules = deployments[0].truss.modules
    bars = [bar for bar in BARS if bar <= modules]

    for deployment, _, style in styled(deployments):
        t = times(deployment)
        motion = deployment.law.motion(t)
        sine, cosine = np.sin(motion.angle), np.cos(motion.angle)
        rates = (
            sine,
            cosine * motion.speed,
            cosine * motion.acceleration - sine * motion.speed**2,
        )
        width = 2 * deployment.truss.half_cross_bar / math.sin(math.pi / modules)
        for bar, shade in zip(bars, SHADES, strict=False):
            chord = width * math.sin(math.pi * (bar - 1) / modules)
            label = f"bar {bar}" if deployment is deployments[0] else None
            for panel, rate in zip(axes, rates, strict=True):
                panel.plot(t, chord * rate, style, color=shade, label=label)

    # shades stand for bars, so that the legend shows the laws' styles in grey
    for deployment, _, style in styled(deployments):
        axes[0].plot([], [], style, color="0.3", label=deployment.name)
    label_times(axes, ("distance [m]", "speed [m/s]", "acceleration [m/s²]"))
    legend_below(figure, axes[0])
    return figure


def energy_figure(deployments: Sequence[Deployment]) -> Figure:
    """Figs 17 and 18: two small energies in panels of their own, the large ones on the right."""
    mu = deployments[0].truss.pulley_friction
    figure, axes = _row(3, f"Energies since the start, pulley friction μ = {mu:g}")
    large = [("work of the motor", "motor", "-"), ("potential", "potential", "--")]
    if mu > 0:
        large.append(("dissipated in the pulleys", "pulleys", ":"))

    for deployment, colour, style in styled(deployments):
        energies = deployment.energies
        for panel, name in zip(axes, ("kinetic", "joints"), strict=False):
            history = getattr(energies, name)
            panel.plot(energies.time, history, style, color=colour, label=deployment.name)
        for _, name, style_of_kind in large:
            axes[2].plot(energies.time, getattr(energies, name), style_of_kind, color=colour)

    # colours stand for laws there, so that the legend shows the styles in grey
    for title, _, style in large:
        axes[2].plot([], [], style, color="0.2", label=title)
    axes[2].legend(frameon=False, fontsize=8)
    label_times(axes, ("kinetic energy [J]", "dissipated in the joints [J]", "energy [J]"))
    legend_below(figure, axes[0])
    return figure


def force_figure(deployments: Sequence[Deployment]) -> Figure:
    """Fig. 19: motor force of all laws, and of the first law under several frictions."""
    first = deployments[0]
    figure, axes = _row(2, "Motor force on each of the two ropes")
    peak = static_peak(first.truss)
    axes[0].axhline(peak.force, color="0.6", lw=0.8, label=f"static peak {peak.force:.2f} N")
    for deployment, colour, style in styled(deployments):
        t = times(deployment)
        _, truss = deployment.at(t)
        axes[0].plot(t, truss.rope_force, style, color=colour, label=deployment.name)
    axes[0].set_title(f"all laws, μ = {first.truss.pulley_friction:g}", fontsize=10)

    largest = first.truss.pulley_friction or PAPER_MU
    for share, shade in zip(MU_SWEEP, SHADES, strict=True):
        t, mu = times(first), share * largest
        _, truss = with_friction(first, mu).at(t)
        axes[1].plot(t, truss.rope_force, color=shade, label=f"μ = {mu:g}")
    axes[1].set_title(f"{first.name}, several frictions", fontsize=10)

    for panel in axes:
        panel.legend(frameon=False, fontsize=8)
    label_times(axes, ("motor force [N]", "motor force [N]"))
    return figure


def tension_figure(deployments: Sequence[Deployment]) -> Figure:
    """Fig. 20: tension of every segment along a rope at several times, a panel a law."""
    figure, axes = _row(len(deployments), "Tension along one rope", share=True)
    truss = deployments[0].truss
    segments = np.arange(1, 4 * truss.modules + 1)
    for panel, deployment in zip(axes, deployments, strict=True):
        peak_time = deployment.extremes["peak-force"].time
        duration = deployment.law.duration
        moments = (0.0, duration / 2, peak_time, duration)
        names = ("start", "half time", "peak force", "end")
        motion, history = deployment.at(np.array(moments))

        for k, (moment, name) in enumerate(zip(moments, names, strict=True)):
            ratios = ca.DM(tension_ratios(truss, float(motion.angle[k]))).full().ravel()
            label = f"{name}, {moment:.4g} s, α = {np.degrees(motion.angle[k]):.1f}°"
            tensions = history.rope_force[k] * ratios
            panel.plot(segments, tensions, color=SHADES[k], lw=WIDTHS[k], label=label)
        panel.set_title(f"{deployment.name}, μ = {truss.pulley_friction:g}", fontsize=10)
        label_axes(panel, "segment, from the motor", "tension [N]" if panel is axes[0] else "")

    axes[0].set_ylim(bottom=0)  # of all: they share the axis, and no curve is still to come
    for panel in axes:
        panel.legend(frameon=False, fontsize=8)
    return figure


def overview_figure(deployments: Sequence[Deployment]) -> Figure:
    """Snapshots of the first law above; rope length, acceleration and force of all laws below."""
    first = deployments[0]
    figure = Figure(figsize=(12.0, 5.6), dpi=110, layout="constrained")
    parts: Any = figure.subfigures(2, 1, height_ratios=(1, 1.5))
    above, below = parts

    above.suptitle(f"{first.truss.modules} modules opening under the {first.name} law")
    for place, fraction in enumerate(OVERVIEW_SNAPSHOTS, start=1):
        panel = above.add_subplot(1, len(OVERVIEW_SNAPSHOTS), place, projection="3d")
        draw_snapshot(panel, first, fraction * first.law.duration)

    axes = list(below.subplots(1, 3))
    for deployment, colour, style in styled(deployments):
        t = times(deployment)
        motion, truss = deployment.at(t)
        histories = (motion.acceleration, truss.rope_length, truss.rope_force)
        for panel, history in zip(axes, histories, strict=True):
            panel.plot(t, history, style, color=colour, label=deployment.name)
    label_times(
        axes, ("angular acceleration [rad/s²]", "length of each rope [m]", "force on each rope [N]")
    )
    legend_below(below, axes[0])
    return figure


def snapshots_figure(deployment: Deployment) -> Figure:
    """The truss at even times, all to the same scale."""
    figure = Figure(figsize=(12.0, 6.0), dpi=150, layout="constrained")
    figure.suptitle(f"The antenna opening under the {deployment.name} law, to scale", fontsize=12)
    for place, fraction in enumerate(SNAPSHOTS, start=1):
        panel: Any = figure.add_subplot(2, 3, place, projection="3d")
        draw_snapshot(panel, deployment, fraction * deployment.law.duration)
    handles = panel.collections
    figure.legend(handles=handles, loc="outside lower center", ncols=len(KINDS), frameon=False)
    return figure


def draw_snapshot(panel: Any, deployment: Deployment, time: float) -> None:
    """The truss at a time [s] in a three-dimensional panel, with a title that says when."""
    truss = deployment.truss
    angle = float(deployment.law.motion(time).angle[0])
    _draw(panel, truss, angle)
    diameter = 2 * truss.half_cross_bar * math.sin(angle) / math.sin(math.pi / truss.modules)
    panel.set_title(
        f"t = {time:.4g} s,  α = {math.degrees(angle):.1f}°,  diameter {diameter:.2f} m",
        fontsize=10,
    )


def _draw(panel: Any, truss: TrussParameters, angle: float) -> None:
    radius = truss.half_cross_bar / math.sin(math.pi / truss.modules)
    for rods, colour, width, name in KINDS:
        lines = Line3DCollection(
            _segments(truss, angle, rods),
            colors=colour,
            linewidths=width,
            label=name,
            clip_on=False,
        )
        panel.add_collection3d(lines)

    # the fixed bar is at the origin; the ring opens along +y from it
    centre = ring_centre(truss, angle)
    panel.set_xlim(centre[0] - radius, centre[0] + radius)
    panel.set_ylim(centre[1] - radius, centre[1] + radius)
    panel.set_zlim(-truss.bar_length, 0)

    panel.set_box_aspect((2 * radius, 2 * radius, truss.bar_length), zoom=1.5)
    panel.view_init(elev=28, azim=-60)
    panel.set_axis_off()


def _segments(
    truss: TrussParameters, angle: float, rods: tuple[tuple[int, int], ...]
) -> list[Array]:
    return [
        np.stack([position(truss, angle, module, node) for node in rod])
        for module in range(1, truss.modules + 1)
        for rod in rods
    ]


def position(truss: TrussParameters, angle: float, module: int, node: int) -> Array:
    """Position of a node of a module, shape (3,) [m]."""
    place: Array = node_position(truss, node, ca.DM(angle), module=module).full().ravel()
    return place


def ring_centre(truss: TrussParameters, angle: float) -> Array:
    """Mean of the upper ends of all vertical bars, shape (3,) [m]."""
    modules = range(1, truss.modules + 1)
    centre: Array = np.mean([position(truss, angle, module, 1) for module in modules], axis=0)
    return centre


def _row(panels: int, title: str, share: bool = False) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(4.3 * panels, 3.6), dpi=150, layout="constrained")
    figure.suptitle(title, fontsize=12)
    axes = figure.subplots(1, panels, sharey=share, squeeze=False)
    return figure, list(axes[0])


def styled(deployments: Sequence[Deployment]) -> Iterator[tuple[Deployment, str, str]]:
    """Each law with its colour and line style."""
    for deployment in deployments:
        yield deployment, *look(deployment.name)


def label_times(axes: Sequence[Axes], labels: Sequence[str]) -> None:
    """Label axes against time, and tidy them."""
    for panel, label in zip(axes, labels, strict=True):
        label_axes(panel, "time [s]", label)
        show_lowest(panel)
