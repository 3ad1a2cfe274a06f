"""Figures after 11-14 and 17-20 of the paper, each with all laws, and a study in one picture.

A function takes deployments and returns a `Figure`; nothing is shown and no global state used.
`draw` takes a result, so that one that was stored is drawn again without solving.
"""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from models.laws import BetweenRests
from models.ring_on_arm import arm_motion
from models.truss import evaluate_motion, ring_radius, rope_leverage, static_peak, tension_ratios
from ocp.arrays import Array
from studies.common.drawing import SHADES, label_axes, legend_below, look, show_lowest
from studies.common.result import Result
from studies.common.scene.moving_picture import MovingPicture
from studies.common.scene.pictures import PARTS, draw_instant, tension_scale
from studies.common.scene.projection import View, outline
from studies.margin.figures import margin_figure
from studies.truss.bars import forces_of
from studies.truss.motions.deployment import Deployment, travel_of
from studies.truss.motions.laws import deployments_of
from studies.truss.quantities import QUANTITIES
from studies.truss.rope_figure import rope_delay_figure, rope_mode_figure
from studies.truss.scene import moving_antenna

POINTS = 1201
MU_SWEEP = (0.0, 0.25, 0.5, 1.0)  # of the truss's own pulley friction
PAPER_MU = 0.01  # for the sweep where the truss has none
WIDTHS = (3.4, 2.6, 1.8, 1.0)  # of lines that may cover one another, lowest first
BARS = (1, 4, 8, 12)  # the vertical bars of Fig. 13
SNAPSHOTS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)  # of the duration, in Fig. 14
OVERVIEW_SNAPSHOTS = (0.0, 0.4, 0.6, 1.0)

ANGLES = 91  # at which the frequencies of the arm are worked out
ABOVE: Mapping[str, Any] = {"xytext": (0, 3), "textcoords": "offset points", "fontsize": 8}
AFTER = 2.0  # periods of the slowest mode for which the arm is drawn after the ring has opened
OPENING = (0.01, 0.99)  # shares of the stroke between which the antenna counts as opening
SHORT = 0.5  # of the duration: a shorter opening is shown alone

Caps = Mapping[str, float]  # by the keys of `studies.truss.quantities`


def draw(result: Result) -> Iterator[tuple[str, Figure]]:
    """Every figure of a result with the name of its file."""
    caps = {row.key: row.cap for row in result.table if row.cap is not None}
    yield from all_figures(deployments_of(result), caps)


def all_figures(
    deployments: Sequence[Deployment], caps: Caps | None = None
) -> Iterator[tuple[str, Figure]]:
    """Every figure with the name of its file; caps are drawn where there are any."""
    caps = caps or {}
    yield "overview", overview_figure(deployments, caps)
    yield "fig11_angle", angle_figure(deployments, caps)
    yield "fig12_rope", rope_figure(deployments, caps)
    yield "fig13_bars", bars_figure(deployments)
    yield "fig14_opening", snapshots_figure(deployments[0])
    frictionless = [with_friction(deployment, 0.0) for deployment in deployments]
    yield "fig17_energy_without_friction", energy_figure(frictionless)
    if deployments[0].truss.pulley_friction > 0 or deployments[0].truss.other_pulleys:
        yield "fig18_energy_with_friction", energy_figure(deployments)
    yield "fig19_motor_force", force_figure(deployments, caps)
    yield "fig20_segment_tensions", tension_figure(deployments)
    yield "bar_forces", bar_forces_figure(deployments[0])
    drive = deployments[0].drive
    if drive is not None and drive.drum_radius is not None:
        yield "drive", drive_figure(deployments)
    if drive is not None and drive.rope_stiffness is not None:
        yield "rope_mode", rope_mode_figure(deployments[0])
        if drive.rope_delay is not None:
            yield "rope_delay", rope_delay_figure(deployments[0])
    if deployments[0].carrier is not None:
        yield "arm", arm_figure(deployments, caps)
    travels = [(one.name, travel) for one in deployments if (travel := travel_of(one)) is not None]
    if travels:
        yield "margins", margin_figure(travels)


def with_friction(deployment: Deployment, mu: float) -> Deployment:
    """The same law on the same truss with pulley friction `mu`."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what the model warns of was said with the study
        truss = dataclasses.replace(deployment.truss, pulley_friction=mu, other_pulleys=())
    return dataclasses.replace(deployment, truss=truss)


def times(deployment: Deployment) -> Array:
    """Times for a curve: even ones and those of kinks [s]."""
    even = np.linspace(0.0, deployment.law.duration, POINTS)
    return np.unique(np.concatenate([even, deployment.edges]))


def angle_figure(deployments: Sequence[Deployment], caps: Caps | None = None) -> Figure:
    """Fig. 11: angle, angular speed and angular acceleration against time."""
    figure, axes = _row(3, "Deployment angle, its speed and acceleration")
    _draw_caps(axes, (None, "peak-speed", "peak-acceleration"), caps)
    for deployment, colour, style in styled(deployments):
        t = times(deployment)
        motion = deployment.law.motion(t)
        histories = (np.degrees(motion.angle), motion.speed, motion.acceleration)
        for panel, history in zip(axes, histories, strict=True):
            panel.plot(t, history, style, color=colour, label=deployment.name)
    label_times(axes, ("angle α [deg]", "angular speed [rad/s]", "angular acceleration [rad/s²]"))
    legend_below(figure, axes[0])
    return figure


def rope_figure(deployments: Sequence[Deployment], caps: Caps | None = None) -> Figure:
    """Fig. 12: length, contraction speed and contraction acceleration of one rope."""
    figure, axes = _row(3, "One driving rope: length, contraction speed and acceleration")
    _draw_caps(axes, (None, "peak-rope-speed", "peak-rope-acceleration"), caps)
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
    """Figs 17 and 18: the small energies of all laws above, the large ones of each law below."""
    mu = deployments[0].truss.pulley_friction
    columns = len(deployments)
    figure = Figure(figsize=(4.3 * max(columns, 2), 6.4), dpi=150, layout="constrained")
    figure.suptitle(f"Energies since the start, pulley friction μ = {mu:g}", fontsize=12)
    parts: Any = figure.subfigures(2, 1)
    above, below = parts

    small = list(above.subplots(1, 2))
    for deployment, colour, style in styled(deployments):
        energies = deployment.energies
        for panel, name in zip(small, ("kinetic", "joints"), strict=True):
            history = getattr(energies, name)
            panel.plot(energies.time, history, style, color=colour, label=deployment.name)
    label_times(small, ("kinetic energy [J]", "dissipated in the joints [J]"))
    legend_below(above, small[0])

    # laws differ by less than the width of a line here: each has a panel of its own
    large = [("work of the motor", "motor", "-"), ("potential energy", "potential", "--")]
    if mu > 0:
        large.append(("dissipated in the pulleys", "pulleys", ":"))
    panels = list(below.subplots(1, columns, sharey=True, squeeze=False)[0])
    for panel, (deployment, colour, _) in zip(panels, styled(deployments), strict=True):
        for title, name, style in large:
            energies = deployment.energies
            panel.plot(energies.time, getattr(energies, name), style, color=colour, label=title)
        panel.set_title(deployment.name, fontsize=10)
        panel.legend(frameon=False, fontsize=8)
    label_times(panels, ("energy [J]", *[""] * (columns - 1)))
    return figure


def force_figure(deployments: Sequence[Deployment], caps: Caps | None = None) -> Figure:
    """Fig. 19: motor force of all laws, and of the first law under several frictions."""
    first = deployments[0]
    figure, axes = _row(2, "Motor force on each of the two ropes")
    _draw_caps(axes, ("peak-force", None), caps)
    peak = static_peak(first.truss, first.opening)
    axes[0].axhline(peak.force, color="0.6", lw=0.8, label=f"static peak {peak.force:.2f} N")
    for deployment, colour, style in styled(deployments):
        t = times(deployment)
        _, truss = deployment.at(t)
        axes[0].plot(t, truss.rope_force, style, color=colour, label=deployment.name)
    axes[0].set_title(f"all laws, μ = {first.truss.pulley_friction:g}", fontsize=10)

    largest = first.truss.pulley_friction or PAPER_MU
    for share, shade in zip(MU_SWEEP, SHADES, strict=True):
        t, mu = times(first), share * largest
        motion, rubbing = first.law.motion(t), with_friction(first, mu).truss
        # friction is modelled for a rope that is wound in; a measured motion may run back
        speed = np.maximum(motion.speed, 0.0)
        truss = evaluate_motion(rubbing, motion.angle, speed, motion.acceleration)
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
        # without friction the curves cross all of a panel, some at its top
        panel.legend(
            frameon=False,
            fontsize=7.5,
            ncols=2,
            handlelength=1.2,
            columnspacing=0.8,
            loc="upper center",
            bbox_to_anchor=(0.5, -0.2),
        )
    return figure


def bar_forces_figure(deployment: Deployment) -> Figure:
    """Largest force in each kind of bar, and the force in every link round the ring."""
    figure = Figure(figsize=(10.0, 4.0), dpi=150, layout="constrained")
    figure.suptitle(f"Forces in the bars under the {deployment.name} law", fontsize=12)
    largest, links = figure.subplots(1, 2)
    angle, forces = forces_of(deployment, times(deployment))
    degrees = np.degrees(angle)

    for kind, shade in zip(forces.bars, SHADES, strict=False):
        name = kind.replace("_", " ").replace("cross bar", "part of cross-bar")
        largest.plot(degrees, forces.largest(kind), color=shade, label=name)
    label_axes(largest, "angle α [deg]", "largest push or pull [N]")
    largest.legend(frameon=False, fontsize=8)

    # left and right half of each module, one above the other; at rest the angle may step back by
    # a rounding
    order = np.argsort(degrees, kind="stable")
    rows = forces.bars["link"].reshape(angle.size, -1).T[:, order]
    most = float(np.abs(rows).max())
    halves = 0.75 + 0.5 * np.arange(len(rows))
    look = {"cmap": "RdBu_r", "vmin": -most, "vmax": most, "rasterized": True}
    image = links.pcolormesh(degrees[order], halves, rows, shading="nearest", **look)
    label_axes(links, "angle α [deg]", "module from the motor; left and right half")
    figure.colorbar(image, ax=links, label="force in the link [N], push positive")
    return figure


def drive_figure(deployments: Sequence[Deployment]) -> Figure:
    """Path of one motor beside its torque-speed curve, and power and energy of both over time."""
    figure, (path, *axes) = _row(3, "One motor at its shaft; both motors over time")
    for deployment, colour, style in styled(deployments):
        t = times(deployment)
        _, truss = deployment.at(t)
        motor = deployment.motor(truss)
        path.plot(motor.shaft_speed, motor.torque, style, color=colour, label=deployment.name)
        axes[0].plot(t, motor.power, style, color=colour)
        axes[1].plot(deployment.energies.time, deployment.motor_energy(), style, color=colour)

    drive, margin = deployments[0].drive, deployments[0].margin
    if drive is not None and drive.torque_speed is not None:
        speeds, torques = np.array(drive.torque_speed).T
        path.plot(speeds, torques, color="black", lw=1.2, label="torque-speed curve")
        cases = [] if margin is None else margin.load_cases(deployments[0].truss)
        left = min((case.derating.whole for case in cases), default=1.0)
        if left < 1.0:
            label = "the same, derated"
            path.plot(speeds, left * torques, color="black", lw=1.2, ls="--", label=label)
    label_axes(path, "speed of the shaft [rad/s]", "torque of the shaft [N m]")
    label_times(axes, ("power [W]", "energy since the start [J]"))
    legend_below(figure, path)
    return figure


def arm_figure(deployments: Sequence[Deployment], caps: Caps | None = None) -> Figure:
    """Tip of the arm that carries the ring, also after the ring has opened; what it adds.

    Beside it the frequencies of the arm; below, moment and momentum at the root with the caps of
    the wheels, and how far a satellite that is free turns.
    """
    figure = Figure(figsize=(13.0, 7.0), dpi=150, layout="constrained")
    figure.suptitle("The arm that carries the ring", fontsize=12)
    panels = list(figure.subplots(2, 3).flat)
    across, added, frequency, moment, handed, turned = panels
    for deployment, colour, style in styled(deployments):
        model, law = deployment.carrier, deployment.law
        assert model is not None  # such figures are drawn of rings on an arm
        after = AFTER / float(model.frequencies(law.end_angle)[0])
        t = np.linspace(0.0, law.duration + after, POINTS)
        moved = arm_motion(model, BetweenRests(law, after=after))
        across.plot(t, 1e3 * moved.tip(t)[1], style, color=colour, label=deployment.name)

        t = times(deployment)
        lever = rope_leverage(deployment.truss, ca.DM(law.motion(t).angle)).full().ravel()
        added.plot(t, np.asarray(deployment.torque_of_arm(t)) / lever, style, color=colour)
        assert deployment.arm is not None
        moment.plot(t, deployment.arm.root_moment(t), style, color=colour)
        handed.plot(t, deployment.arm.angular_momentum(t), style, color=colour)
        turned.plot(t, np.degrees(deployment.arm.satellite_turn(t)), style, color=colour)

    first = deployments[0]
    assert first.carrier is not None
    angles = np.linspace(first.law.start_angle, first.law.end_angle, ANGLES)
    modes = np.array([first.carrier.frequencies(angle) for angle in angles]).T
    for number, mode in enumerate(modes, start=1):
        frequency.plot(np.degrees(angles), mode, color="black", lw=1.0)
        at = (float(np.degrees(angles[0])), float(mode[0]))
        frequency.annotate(f"mode {number}", at, **ABOVE)
    frequency.set_yscale("log")
    frequency.set_ylim(top=2.5 * modes.max())  # room for the words
    label_axes(frequency, "angle α [deg]", "frequency of the arm, ring held [Hz]")
    across.axvline(first.law.duration, color="0.5", lw=0.8)
    across.set_title("grey line: the ring is open", fontsize=10)
    label_axes(across, "time [s]", "tip across the arm [mm]")
    label_axes(added, "time [s]", "added to the rope force [N]")
    label_axes(moment, "time [s]", "moment about the root [N m]")
    label_axes(handed, "time [s]", "momentum at the root [N m s]")
    label_axes(turned, "time [s]", "turn of the satellite [deg]")
    if first.carrier.satellite_inertia is None:
        turned.remove()  # it is held
    _draw_caps((moment, handed), ("peak-root-moment", "peak-root-momentum"), caps)
    legend_below(figure, across)
    return figure


def overview_figure(deployments: Sequence[Deployment], caps: Caps | None = None) -> Figure:
    """Snapshots of the first law above; rope length, acceleration and force of all laws below.

    A law that opens the antenna in a small part of its duration is shown in these seconds alone.
    """
    first = deployments[0]
    window = opening(first)
    figure = Figure(figsize=(12.0, 5.9), dpi=110, layout="constrained")
    parts: Any = figure.subfigures(2, 1, height_ratios=(1.2, 1.5))
    above, below = parts

    above.suptitle(f"{first.truss.modules} modules opening under the {first.name} law")
    picture = moving_antenna([first])
    times_shown = [window[0] + share * (window[1] - window[0]) for share in OVERVIEW_SNAPSHOTS]
    for panel, time in zip(above.subplots(1, len(times_shown)), times_shown, strict=True):
        draw_snapshot(panel, first, picture, time)

    axes = list(below.subplots(1, 3))
    _draw_caps(axes, ("peak-acceleration", None, "peak-force"), caps)
    for deployment, colour, style in styled(deployments):
        t = times(deployment)
        motion, truss = deployment.at(t)
        histories = (motion.acceleration, truss.rope_length, truss.rope_force)
        for panel, history in zip(axes, histories, strict=True):
            panel.plot(t, history, style, color=colour, label=deployment.name)
    label_times(
        axes, ("angular acceleration [rad/s²]", "length of each rope [m]", "force on each rope [N]")
    )
    if window != (0.0, first.law.duration):
        for panel in axes:
            panel.set_xlim(*window)
    legend_below(below, axes[0])
    return figure


def opening(deployment: Deployment) -> tuple[float, float]:
    """The seconds in which a law opens the antenna, or all of its time if that is most of it."""
    duration = deployment.law.duration
    t = times(deployment)
    angle = deployment.law.motion(t).angle
    stroke = deployment.law.end_angle - deployment.law.start_angle
    low, high = (deployment.law.start_angle + share * stroke for share in OPENING)
    start, end = float(t[np.argmax(angle > low)]), float(t[np.argmax(angle >= high)])
    if end - start > SHORT * duration:
        return 0.0, duration
    room = 0.25 * (end - start)
    return max(0.0, start - room), min(duration, end + room)


def snapshots_figure(deployment: Deployment) -> Figure:
    """The truss at even times of its opening, all to the same scale."""
    figure = Figure(figsize=(12.0, 6.0), dpi=150, layout="constrained")
    figure.suptitle(f"The antenna opening under the {deployment.name} law, to scale", fontsize=12)
    picture = moving_antenna([deployment])
    panels = figure.subplots(2, 3)
    low, high = opening(deployment)
    for panel, share in zip(panels.flat, SNAPSHOTS, strict=True):
        draw_snapshot(panel, deployment, picture, low + share * (high - low))

    tension_scale(figure, panels, picture)
    lines = [
        Line2D([], [], color=colour, lw=width, label=kind)
        for kind, (colour, width) in PARTS.items()
        if kind in {strand.kind for strand in picture.strands}
    ]
    figure.legend(handles=lines, loc="outside lower center", ncols=len(lines), frameon=False)
    return figure


def draw_snapshot(panel: Axes, deployment: Deployment, picture: MovingPicture, time: float) -> None:
    """The truss at a time [s], with a title that says when."""
    truss = deployment.truss
    angle = float(deployment.law.motion(time).angle[0])
    draw_instant(panel, picture, picture.laws[0], time, frame=outline(picture, View()))
    diameter = 2 * float(ring_radius(truss, angle))
    panel.set_title(
        f"t = {time:.4g} s\nα = {math.degrees(angle):.1f}°,  diameter {diameter:.2f} m",
        fontsize=10,
    )


def _draw_caps(axes: Sequence[Axes], keys: Sequence[str | None], caps: Caps | None) -> None:
    """A dotted line at each cap, on both sides of zero where a quantity has both signs."""
    for panel, key in zip(axes, keys, strict=True):
        cap = (caps or {}).get(key or "")
        if cap is None:
            continue
        signs = (1.0, -1.0) if key and QUANTITIES[key].both_signs else (1.0,)
        for number, sign in enumerate(signs):
            label = None if number else "cap"
            panel.axhline(sign * cap, color="0.4", lw=0.9, ls=":", label=label)


def _row(panels: int, title: str, share: bool = False) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(4.3 * panels, 3.6), dpi=150, layout="constrained")
    figure.suptitle(title, fontsize=12)
    axes = figure.subplots(1, panels, sharey=share, squeeze=False)
    return figure, list(axes[0])


def styled(deployments: Sequence[Deployment]) -> Iterator[tuple[Deployment, str, str]]:
    """Each law with its colour and line style; two solid lines would hide each other."""
    drawn: set[str] = set()
    for deployment in deployments:
        colour, style = look(deployment.name)
        yield deployment, colour, ":" if style == "-" and style in drawn else style
        drawn.add(style)


def label_times(axes: Sequence[Axes], labels: Sequence[str]) -> None:
    """Label axes against time, and tidy them."""
    for panel, label in zip(axes, labels, strict=True):
        label_axes(panel, "time [s]", label)
        show_lowest(panel)
