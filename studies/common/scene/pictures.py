"""A moving picture drawn with Matplotlib: one instant of it in a panel, or all of it as a film."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure

from ocp.arrays import Array
from studies.common.console import Console
from studies.common.drawing import COLOURS, label_axes
from studies.common.exit_codes import StudyError
from studies.common.scene.moving_picture import LawOfMotion, MovingPicture
from studies.common.scene.projection import PictureFrame, View, outline, project

FRAMES, RATE = 84, 12  # of a film: seven seconds, which is short enough to be watched twice
HOLD = 12  # frames at which the end stands still
RAMP = LinearSegmentedColormap.from_list(
    "tension", ["#3f6fb5", "#7b5ea7", "#c2457f", "#e8603c", "#f0a30a"]
)
PARTS = {  # colour and width of lines
    "vertical bars": ("#33475b", 1.3),
    "cross-bars": ("#b4bfca", 2.2),
    "links": ("#8d6e3f", 0.8),
    "net": ("#7aa37a", 0.4),
    "arm": ("#444c56", 4.0),
    "motor": ("#b3261e", 1.2),
    "big arm": ("#33475b", 3.5),
    "small arm": (COLOURS[0], 2.0),
}
ROPE_WIDTH = 0.9
SLACK = 0.4  # opacity


def most_tension(picture: MovingPicture) -> float:
    """Largest force on a rope of all laws [N]."""
    return max((float(law.force.max()) for law in picture.laws if law.force.size), default=1.0)


def draw_instant(
    panel: Axes,
    picture: MovingPicture,
    law: LawOfMotion,
    time: float,
    *,
    view: View | None = None,
    frame: PictureFrame | None = None,
) -> None:
    """The picture at a time [s], all lines in the order of their depth.

    Parameters
    ----------
    frame : PictureFrame, optional
        Room for the whole motion; without one the instant fills the panel.
    """
    view = view or (View.flat() if picture.flat else View())
    value = law.at(time)
    points = project(picture.points(value), view)
    origin = points[picture.centre] if picture.centre >= 0 else np.zeros(3)
    points = points - origin

    ends, colours, widths = _lines(picture, law, value, time)
    segments = points[ends]
    order = np.argsort(segments[:, :, 2].mean(axis=1), kind="stable")
    panel.add_collection(
        LineCollection(
            list(segments[order][:, :, :2]),
            colors=colours[order],
            linewidths=widths[order],
            capstyle="round",
        )
    )
    panel.set_aspect("equal")
    panel.set_axis_off()
    _frame(panel, segments[:, :, :2].reshape(-1, 2) if frame is None else frame)


def _frame(panel: Axes, what: Array | PictureFrame) -> None:
    if isinstance(what, PictureFrame):
        middle, half = what.middle, np.array([what.width, what.height]) / 2
    else:
        low, high = what.min(axis=0), what.max(axis=0)
        middle, half = (low + high) / 2, (high - low) / 2
    reach = 1.06 * np.maximum(half, 1e-9)
    panel.set_xlim(middle[0] - reach[0], middle[0] + reach[0])
    panel.set_ylim(middle[1] - reach[1], middle[1] + reach[1])


def _lines(
    picture: MovingPicture, law: LawOfMotion, value: float, time: float
) -> tuple[Array, Array, Array]:
    """Ends (m, 2), colours (m, 4) and widths (m,) of all lines."""
    from matplotlib.colors import to_rgba

    ends, colours, widths = [], [], []
    for strand in picture.strands:
        colour, width = PARTS.get(strand.kind, ("#33475b", 2.0))
        slack = value < picture.slack.get(strand.kind, -np.inf)
        ends.append(strand.pairs)
        colours.append(np.tile(to_rgba(colour, SLACK if slack else 1.0), (len(strand.pairs), 1)))
        widths.append(np.full(len(strand.pairs), width))

    if picture.tension is not None:
        force = float(np.interp(time, law.times, law.force))
        tensions = force * np.exp(picture.tension.exponents @ [1.0, value])
        shades = RAMP(tensions / most_tension(picture))
        for path in picture.tension.paths:
            ends.append(np.stack([path[:-1], path[1:]], axis=1))
            colours.append(shades)
            widths.append(np.full(len(tensions), ROPE_WIDTH))
    return np.concatenate(ends), np.concatenate(colours), np.concatenate(widths)


def save_strip(picture: MovingPicture, path: Path, shares: Sequence[float]) -> None:
    """Write the first law's motion at shares of its duration, beside each other, as a picture."""
    law = picture.laws[0]
    view = View.flat() if picture.flat else View()
    frame = outline(picture, view)
    figure = Figure(figsize=(3.6, 1.6), dpi=200, layout="constrained")
    for panel, share in zip(figure.subplots(1, len(shares)), shares, strict=True):
        time = float(share * law.times[-1])
        draw_instant(panel, picture, law, time, view=view, frame=frame)
        panel.set_title(f"{time:.4g} s", fontsize=9)
    figure.savefig(path)


def tension_scale(figure: Figure, panels: Any, picture: MovingPicture) -> None:
    """A bar that says which colour is which tension."""
    from matplotlib.cm import ScalarMappable

    scale = ScalarMappable(Normalize(0.0, most_tension(picture)), RAMP)
    bar = figure.colorbar(scale, ax=panels, shrink=0.7, aspect=30)
    bar.set_label("tension of the ropes [N]")


def check_film(kind: str) -> None:
    """Refuse a film that this machine cannot make, before any work.

    Raises
    ------
    StudyError
        If an MP4 is asked for and there is no ffmpeg.
    """
    if kind == "mp4" and shutil.which("ffmpeg") is None:
        raise StudyError(
            "an MP4 needs the program ffmpeg, which is not on the PATH; install it or "
            "choose --animation gif"
        )


def save_film(picture: MovingPicture, path: Path, console: Console) -> None:
    """Write the motion of the first law as GIF or MP4, by the ending of `path`."""
    from matplotlib.animation import FFMpegWriter, PillowWriter

    check_film(path.suffix[1:])
    law = picture.laws[0]
    figure = Figure(figsize=(6.4, 4.8), dpi=100, layout="constrained")
    stage, curve = figure.subplots(2, 1, height_ratios=(3.2, 1))
    view = View.flat() if picture.flat else View()
    frame = outline(picture, view)
    if picture.tension is not None:
        tension_scale(figure, stage, picture)

    label, values = _followed(picture, law)
    curve.plot(law.times, values, color=COLOURS[0])
    (mark,) = curve.plot([law.times[0]], [values[0]], "o", color=COLOURS[1])
    label_axes(curve, "time [s]", label)

    shares = np.concatenate([np.linspace(0.0, 1.0, FRAMES - HOLD), np.ones(HOLD)])
    writer = PillowWriter(fps=RATE) if path.suffix == ".gif" else FFMpegWriter(fps=RATE)
    with writer.saving(figure, str(path), dpi=100):
        for number, share in enumerate(shares, start=1):
            time = float(share * law.times[-1])
            stage.clear()
            draw_instant(stage, picture, law, time, view=view, frame=frame)
            stage.set_title(_caption(picture, law, time), fontsize=10)
            mark.set_data([time], [np.interp(time, law.times, values)])
            writer.grab_frame()
            console.live(f"film: frame {number} of {len(shares)}")


def _followed(picture: MovingPicture, law: LawOfMotion) -> tuple[str, Array]:
    """The curve below the film: the force, or how far the last point is from the first."""
    if law.force.size:
        return "force [N]", law.force
    last = picture.strands[-1].pairs[-1, 1]
    height = [picture.points(float(value))[last, 1] for value in law.values]
    return "tip, y [m]", np.array(height)


def _caption(picture: MovingPicture, law: LawOfMotion, time: float) -> str:
    if picture.flat:
        return f"{law.name}: t = {time:.2f} s"
    return f"{law.name}: t = {time:.1f} s, α = {np.degrees(law.at(time)):.1f}°"
