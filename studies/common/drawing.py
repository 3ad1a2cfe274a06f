"""The look that all figures share: a colour and a line style for each law, tidy axes, legends."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import ScalarFormatter

from ocp.nlp.interrupts import noted_interrupts
from studies.common.charts import written_unit

if TYPE_CHECKING:
    from studies.common.console import Console
    from studies.common.folder import ResultsFolder

# told apart by the colour-blind, with the styles
COLOURS = (
    "#0072b2",
    "#d55e00",
    "#009e73",
    "#b0568f",
    "#b27d00",
    "#3d405b",
    "#767676",
    "#222222",
)
STYLES = ("-", "--", "-.", ":", "-", "--", "-.", "-")
SHADES = ("#9ecae1", "#4a98c9", "#1764ab", "#08306b")  # of one law, light to dark
LAWS = ("optimum", "Bezier", "Step5", "quintic", "linear torque", "ZVD", "ZV", "profile")
FLATTENED = 30.0  # ratio of two curves' peaks beyond which the lower one is a flat line


# without the time of drawing, so that the same result gives the same file
_METADATA: Mapping[str, dict[str, None]] = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}


def look(name: str) -> tuple[str, str]:
    """Colour and line style of a law, the same in all figures; names unknown look optimal.

    A law may state a frequency behind its name, as in "ZVD 0.996 Hz".
    """
    known = [law for law in LAWS if name == law or name.startswith(f"{law} ")]
    place = LAWS.index(known[0]) if known else 0
    return COLOURS[place], STYLES[place]


def save(
    figures: Iterable[tuple[str, Figure]],
    folder: ResultsFolder,
    console: Console,
    kinds: Sequence[str] = ("png",),
) -> int:
    """Draw figures one by one, each into a file of its name and of each kind; how many there were.

    Ctrl-C is acted on between two figures: raised within Matplotlib it can be swallowed.
    """
    count = 0
    with noted_interrupts() as interrupts:
        for name, figure in figures:
            console.live(f"drawing {name}")
            for kind in kinds:
                figure.savefig(folder.file(f"{name}.{kind}"), metadata=_METADATA.get(kind))
            count += 1
            if interrupts.asked:
                raise KeyboardInterrupt
    return count


def label_axes(panel: Axes, x: str, y: str, fit: bool = True) -> None:
    """Name the axes of a panel and give it the look of all others; `fit` leaves no room aside."""
    panel.set_xlabel(written_unit(x))
    panel.set_ylabel(written_unit(y))
    panel.grid(color="0.9", lw=0.6)
    panel.set_axisbelow(True)
    if fit:
        panel.margins(x=0.01)
    if isinstance(panel.yaxis.get_major_formatter(), ScalarFormatter):
        panel.ticklabel_format(axis="y", style="sci", scilimits=(-3, 4), useMathText=True)
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)


def logarithmic_below(panel: Axes) -> None:
    """Make the horizontal axis logarithmic, with plain numbers such as 0.2 or 30 at its marks."""
    panel.set_xscale("log")
    panel.xaxis.set_major_formatter("{x:g}")
    # of the marks between the powers of ten these have room for a number
    panel.xaxis.set_minor_formatter(lambda x, _: f"{x:g}" if f"{x:e}"[0] in "235" else "")


def show_lowest(panel: Axes) -> None:
    """Make the value axis that of the area sine, if one curve's peak flattens another curve."""
    values = [np.asarray(line.get_ydata(), float) for line in panel.get_lines()]
    peaks = [peak for v in values if v.size and (peak := float(np.abs(v).max())) > 0]
    if not peaks or max(peaks) < FLATTENED * min(peaks):
        return

    # linear up to a third of the lowest peak, so that its curve has a shape
    width = float(f"{min(peaks) / 3:.0e}")
    panel.set_yscale("asinh", linear_width=width)
    low, high = panel.get_ylim()

    decades = 10.0 ** np.arange(np.ceil(np.log10(3 * width)), np.log10(max(-low, high)))
    ticks = np.concatenate([-decades[::-1], [0.0], decades])
    panel.set_yticks(ticks[(low < ticks) & (ticks < high)])
    panel.set_yticks([], minor=True)
    panel.set_ylabel(f"{panel.get_ylabel()}\nlogarithmic far beyond ±{width:g}")


def smoothest_on_top(panel: Axes) -> None:
    """Draw curves that rattle below those that do not, which they would hide."""

    def path(values: np.ndarray) -> float:
        return float(np.abs(np.diff(values)).sum())

    lines = [line for line in panel.get_lines() if line.get_zorder() == 2]
    lines.sort(key=lambda line: -path(np.asarray(line.get_ydata(), float)))
    for order, line in enumerate(lines):
        line.set_zorder(2 + order / (len(lines) + 1))


def legend_below(figure: Figure, panel: Axes, columns: int = 7) -> None:
    """One legend below all panels, of the curves of one."""
    handles, labels = panel.get_legend_handles_labels()
    columns = min(len(labels), columns)
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, frameon=False)
