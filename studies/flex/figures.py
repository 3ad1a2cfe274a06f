"""Figures of a chain's motion, from its result: poses, joints, ends, bending, energies, sweeps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure

from ocp.arrays import Array
from studies.common.drawing import COLOURS, SHADES, STYLES, label_axes
from studies.common.result import Result
from studies.flex.config import SWEEPS

SHOWN = 11  # poses in the picture of the motion
# [in]: of a panel to scale its longer side, the least of the other; what stands beside and above it
PANEL, NARROW, ASIDE, ABOVE = 4.6, 1.6, 1.8, 1.1
QUIET = 1e-12  # below this share of what moves, a curve is rounding


def draw(result: Result) -> Iterator[tuple[str, Figure]]:
    """Every figure of a result with the name of its file."""
    yield "motion", motion_figure(result)
    yield "joints", joint_figure(result)
    yield "ends", end_figure(result)
    yield "energies", energy_figure(result)
    if "apart" in result.arrays:
        yield "forms", form_figure(result)
    for quantity in SWEEPS:
        if any(law.startswith(f"{quantity} x") for law in result.laws):
            yield f"sweep_{quantity}", sweep_figure(result, quantity)


def links_of(result: Result) -> int:
    """Number of links."""
    return len(result.configuration["link"])


def _row(panels: int, title: str) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(4.8 * panels, 3.8), dpi=150, layout="constrained")
    figure.suptitle(title, fontsize=11)
    return figure, list(figure.subplots(1, panels, squeeze=False)[0])


def poses_of(result: Result) -> tuple[Array, Array, Array]:
    """Times of the poses (f,) [s], and x and y of all nodes (f, p) [m]."""
    frames = result.details["poses"]["frames"]
    shaped = [
        result.arrays[name].values.reshape(frames, -1) for name in ("pose_time", "pose_x", "pose_y")
    ]
    return shaped[0][:, 0], shaped[1], shaped[2]


def _curve(result: Result, name: str) -> tuple[Array, Array]:
    series = result.arrays[name]
    return result.arrays[series.axis].values, series.values


def motion_figure(result: Result) -> Figure:
    """The chain at even times, light to dark, with the path of its tip."""
    times, x, y = poses_of(result)
    tip = links_of(result) - 1
    path = result.arrays[f"x_{tip}"].values, result.arrays[f"y_{tip}"].values
    figure = Figure(figsize=_page((x, path[0]), (y, path[1])), dpi=150, layout="constrained")
    panel = figure.subplots()
    shades = LinearSegmentedColormap.from_list("poses", SHADES)
    scale = Normalize(float(times[0]), float(times[-1]))

    panel.plot(*path, color="0.6", lw=0.8, ls="--", label="path of the tip")
    nodes = x.shape[1] // links_of(result)
    for place in np.linspace(0, len(times) - 1, SHOWN).round().astype(int):
        colour = shades(scale(times[place]))
        panel.plot(x[place], y[place], color=colour, lw=1.6)
        ends = x[place][nodes - 1 :: nodes], y[place][nodes - 1 :: nodes]
        panel.plot(*ends, "o", ms=3.5, color=colour)
    panel.plot(0.0, 0.0, "s", ms=6, color="0.2", label="root")

    panel.set_aspect("equal", adjustable="box")
    label_axes(panel, "x [m]", "y [m]", fit=False)
    panel.legend(frameon=False, fontsize=8, ncols=2, loc="lower left", bbox_to_anchor=(0, 1))
    figure.colorbar(ScalarMappable(scale, shades), ax=panel, label="time [s]", shrink=0.8)
    figure.suptitle(f"The chain at {SHOWN} times, to scale", fontsize=11)
    return figure


def _page(x: Sequence[Array], y: Sequence[Array]) -> tuple[float, float]:
    """Size of a page [in] that a picture to scale fills, whose panel shows all x and y."""
    width, height = (max(v.max() for v in some) - min(v.min() for v in some) for some in (x, y))
    scale = PANEL / max(width, height, 1e-12)
    return max(scale * width, NARROW) + ASIDE, max(scale * height, NARROW) + ABOVE


def _events(result: Result, panels: Sequence[Axes]) -> None:
    for number, event in enumerate(result.details["events"]):
        for panel in panels:
            label = f"joint {event['joint']} locks"
            colour = COLOURS[1 + number % 5]
            panel.axvline(event["time"], color=colour, lw=0.8, ls=":", label=label)


def _per_link(result: Result, panel: Axes, series: str, name: str, factor: float = 1.0) -> None:
    for k in range(links_of(result)):
        t, values = _curve(result, f"{series}_{k}")
        colour, style = COLOURS[k % len(COLOURS)], STYLES[k % len(STYLES)]
        panel.plot(t, factor * values, style, color=colour, lw=1.2, label=f"{name} {k}")


def joint_figure(result: Result) -> Figure:
    """Angles of the joints and the torques at them."""
    figure, panels = _row(2, "Joints; torques are given, or the reaction of a held or driven joint")
    _per_link(result, panels[0], "angle", "joint", 180.0 / np.pi)
    _per_link(result, panels[1], "torque", "joint")
    _events(result, panels)
    for panel, label in zip(panels, ("angle [deg]", "torque [N m]"), strict=True):
        label_axes(panel, "time [s]", label)
        _least_range(panel)
        panel.legend(frameon=False, fontsize=8)
    return figure


def end_figure(result: Result) -> Figure:
    """Where the links' ends are, and how far each link bends."""
    figure, panels = _row(3, "Ends of the links")
    for panel, series, label in zip(
        panels,
        ("x", "y", "bending"),
        ("x [m]", "y [m]", "end across the tangent at the start [m]"),
        strict=True,
    ):
        _per_link(result, panel, series, "link")
        _events(result, [panel])
        label_axes(panel, "time [s]", label)
        _least_range(panel)
    panels[0].legend(frameon=False, fontsize=8)
    return figure


def _least_range(panel: Axes, least: float = 1e-9) -> None:
    """Widen the axis of a constant, whose rounding would fill the panel."""
    low, high = panel.get_ylim()
    width = least * max(1.0, abs(low), abs(high))
    if high - low < width:
        middle = (low + high) / 2
        panel.set_ylim(middle - 0.5, middle + 0.5)


def energy_figure(result: Result) -> Figure:
    """The energies, and what of their sum appears or vanishes."""
    figure, panels = _row(2, "Energies, and the error of their balance")
    t = result.arrays["time"].values
    work = np.sum([result.arrays[f"work_{k}"].values for k in range(links_of(result))], axis=0)
    parts = {
        "kinetic": result.arrays["kinetic"].values,
        "strain": result.arrays["strain"].values,
        "gravity": result.arrays["gravity"].values,
        "work of the joints": work,
        "lost to damping": result.arrays["dissipated"].values,
        "lost by locks": result.arrays["lost"].values,
    }
    scale = max(float(np.abs(values).max()) for values in parts.values())
    shown = {n: v for n, v in parts.items() if float(np.abs(v).max()) > QUIET * scale}
    for place, (name, values) in enumerate(shown.items()):
        panels[0].plot(t, values, STYLES[place], color=COLOURS[place], lw=1.2, label=name)
    panels[1].plot(t, result.arrays["defect"].values, color=COLOURS[0], lw=1.0)
    for panel, label in zip(panels, ("energy [J]", "error of the energy balance [J]"), strict=True):
        label_axes(panel, "time [s]", label)
    _events(result, panels[1:])
    panels[0].legend(frameon=False, fontsize=8, ncols=3, loc="lower left", bbox_to_anchor=(0, 1))
    return figure


def form_figure(result: Result) -> Figure:
    """How far both forms of the equations are apart, and what the index-1 form leaves open."""
    figure, panels = _row(2, "Eliminated constraints (minimal) against multipliers (index-1)")
    for panel, name, label in zip(
        panels,
        ("apart", "gap_index_1"),
        ("distance between both tips [m]", "constraint violation, index-1 [m]"),
        strict=True,
    ):
        t, values = _curve(result, name)
        panel.semilogy(t, np.maximum(values, 1e-17), color=COLOURS[0], lw=0.9)
        panel.set_ylim(bottom=1e-17)
        label_axes(panel, "time [s]", label)
    return figure


def sweep_figure(result: Result, quantity: str) -> Figure:
    """Vibration, first frequency and energy left against one multiple."""
    titles = {"speed": "pace", "length": "lengths", "modulus": "Young's moduli"}
    figure, panels = _row(3, f"The same case with a multiple of its {titles[quantity]}")
    first = result.laws[0]
    columns = {first: 1.0}
    for law in result.laws:
        if law.startswith(f"{quantity} x"):
            columns[law] = float(law.split(" x ")[1])
    names = sorted(columns, key=lambda name: columns[name])
    factors = [columns[name] for name in names]

    rows = {row.key: row for row in result.table}
    last = links_of(result) - 1
    for panel, key, label in (
        (panels[0], f"vibration_{last}", f"vibration of link {last} [m]"),
        (panels[1], "frequency", "first frequency at the end [Hz]"),
        (panels[2], "left", "kinetic and strain energy at the end [J]"),
    ):
        panel.plot(factors, [rows[key].values[name] for name in names], "o-", color=COLOURS[0])
        panel.set_xscale("log")
        panel.set_xticks(factors, [f"{factor:g}" for factor in factors])
        panel.set_xticks([], minor=True)
        label_axes(panel, f"multiple of the {titles[quantity]}", label, fit=False)
        panel.set_ylim(0.0, 1.1 * max(rows[key].values[name] for name in names) or 1.0)
    return figure
