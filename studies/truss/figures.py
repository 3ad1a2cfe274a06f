"""Figures after 11-14 and 17-20 of the paper, each with all laws.

A function takes deployments and returns a `Figure`; nothing is shown and no global state used.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

import casadi as ca
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from models.truss import static_peak, tension_ratios
from studies.truss.deployment import Deployment

Array = NDArray[np.float64]

COLOURS = ("#0b5fa5", "#d1495b", "#5a8f29", "#8e6c8a")  # by law; told apart by the colour-blind
STYLES = ("-", "--", "-.", ":")
SHADES = ("#c6dbef", "#6baed6", "#2171b5", "#08306b")  # of one law, light to dark
POINTS = 1201
MU_SWEEP = (0.0, 0.25, 0.5, 1.0)  # of the truss's own pulley friction
PAPER_MU = 0.01  # for the sweep where the truss has none
BARS = (1, 4, 8, 12)  # the vertical bars of Fig. 13


def all_figures(deployments: Sequence[Deployment]) -> Iterator[tuple[str, Figure]]:
    """Every figure with the name of its file."""
    # imported here: they need the figures' palette
    from studies.truss.overview import overview_figure
    from studies.truss.snapshots import snapshots_figure

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
    figure, axes = _row(3, "Deployment angle")
    for deployment, colour, style in styled(deployments):
        t = times(deployment)
        motion = deployment.law.motion(t)
        histories = (np.degrees(motion.angle), motion.speed, motion.acceleration)
        for panel, history in zip(axes, histories, strict=True):
            panel.plot(t, history, style, color=colour, label=deployment.name)
    label_times(axes, ("angle α [deg]", "angular speed [rad/s]", "angular acceleration [rad/s²]"))
    _legend(figure, axes[0])
    return figure


def rope_figure(deployments: Sequence[Deployment]) -> Figure:
    """Fig. 12: length, contraction speed and contraction acceleration of one rope."""
    figure, axes = _row(3, "One driving rope")
    for deployment, colour, style in styled(deployments):
        t = times(deployment)
        _, truss = deployment.at(t)
        histories = (truss.rope_length, -truss.rope_speed, -truss.rope_acceleration)
        for panel, history in zip(axes, histories, strict=True):
            panel.plot(t, history, style, color=colour, label=deployment.name)
    label_times(axes, ("length [m]", "contraction speed [m/s]", "contraction acceleration [m/s²]"))
    _legend(figure, axes[0])
    return figure


def bars_figure(deployments: Sequence[Deployment]) -> Figure:
    """Fig. 13: distance of vertical bars from the fixed one, its speed and acceleration."""
    figure, axes = _row(3, "Vertical bars, distance from the fixed bar 1")
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
    for deployment, _, style in styled(deployments):
        axes[0].plot([], [], style, color="0.3", label=deployment.name)
    label_times(axes, ("distance [m]", "speed [m/s]", "acceleration [m/s²]"))
    _legend(figure, axes[0])
    return figure


def energy_figure(deployments: Sequence[Deployment]) -> Figure:
    """Figs 17 and 18: small energies on the left, large ones on the right."""
    mu = deployments[0].truss.pulley_friction
    figure, axes = _row(2, f"Energies since the start, μ = {mu:g}")
    small = (("kinetic", "kinetic", "-"), ("joints, dissipated", "joints", ":"))
    large = [("work of the motor", "motor", "-"), ("potential", "potential", "--")]
    if mu > 0:
        large.append(("pulleys, dissipated", "pulleys", ":"))
    for panel, curves in zip(axes, (small, large), strict=True):
        for deployment, colour, _ in styled(deployments):
            energies = deployment.energies
            for _, name, style in curves:
                panel.plot(energies.time, getattr(energies, name), style, color=colour)
        for title, _, style in curves:
            panel.plot([], [], style, color="0.2", label=title)
        panel.legend(frameon=False, loc="upper left")
    for deployment, colour, _ in styled(deployments):
        axes[0].plot([], [], color=colour, label=deployment.name)
    label_times(axes, ("energy [J]", "energy [J]"))
    _law_legend(figure, deployments)
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
        panel.legend(frameon=False, loc="upper left", bbox_to_anchor=(0.0, 0.92))
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
            panel.plot(segments, tensions, color=SHADES[k], lw=1.5, label=label)
        panel.set_title(f"{deployment.name}, μ = {truss.pulley_friction:g}", fontsize=10)
        panel.set_xlabel("segment, from the motor")
        panel.set_ylim(bottom=0)
        panel.legend(frameon=False, fontsize=8)
        _tidy(panel)
    axes[0].set_ylabel("tension [N]")
    return figure


def _row(panels: int, title: str, share: bool = False) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(4.3 * panels, 3.6), dpi=150, layout="constrained")
    figure.suptitle(title, fontsize=12)
    axes = figure.subplots(1, panels, sharey=share, squeeze=False)
    return figure, list(axes[0])


def styled(deployments: Sequence[Deployment]) -> Iterator[tuple[Deployment, str, str]]:
    """Each law with its colour and line style."""
    yield from zip(deployments, COLOURS, STYLES, strict=False)


def label_times(axes: Sequence[Axes], labels: Sequence[str]) -> None:
    """Label axes against time, and tidy them."""
    for panel, label in zip(axes, labels, strict=True):
        panel.set_xlabel("time [s]")
        panel.set_ylabel(label)
        _tidy(panel)


def _tidy(panel: Axes) -> None:
    panel.grid(color="0.9", lw=0.6)
    panel.set_axisbelow(True)
    panel.margins(x=0.01)
    panel.ticklabel_format(axis="y", style="sci", scilimits=(-2, 4), useMathText=True)
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)


def _legend(figure: Figure, panel: Axes) -> None:
    """One legend below all panels."""
    handles, labels = panel.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)


def _law_legend(figure: Figure, deployments: Sequence[Deployment]) -> None:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=colour, label=d.name) for d, colour, _ in styled(deployments)]
    figure.legend(
        handles=handles, loc="outside lower center", ncols=len(deployments), frameon=False
    )
