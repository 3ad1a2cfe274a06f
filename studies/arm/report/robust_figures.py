"""Figures of robust motions beside the nominal one: residual over the spread, and torque."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from studies.arm.questions.robust.comparison import Comparison
from studies.arm.replay.spread import WIDTH
from studies.arm.report.figures import TITLES
from studies.arm.stage import JOINT_NAMES
from studies.common.drawing import COLOURS, STYLES, label_axes

_SAMPLES = 2001


def spread_figure(found: Comparison) -> Figure:
    """Worst residual along each factor, whatever the other one is, of all motions."""
    drawn = Figure(figsize=(11, 4.6), dpi=150, layout="constrained")
    panels = drawn.subplots(1, 2, sharey=True)
    for axis, (panel, name) in enumerate(zip(panels, found.spread.axes, strict=True)):
        for done, colour, style in zip(found.outcomes, COLOURS, STYLES, strict=False):
            for values, mark, label in (
                (done.reduced, style, done.solved.name), (done.full, "o", None),
            ):  # fmt: skip
                side = 100 * np.linspace(-WIDTH, WIDTH, len(values))
                panel.semilogy(side, values.max(axis=1 - axis), mark, color=colour, label=label)
        label_axes(panel, f"{name} off its nominal value [%]", "", fit=False)
    panels[0].set_ylabel("worst $\\sqrt{E_{res}}$ [$\\sqrt{J}$]")
    reduced, full = (
        " x ".join(map(str, x.shape)) for x in (found.nominal.reduced, found.nominal.full)
    )
    title = f"lines: {reduced} arms on B21; dots: {full} arms on the full model"
    drawn.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3,
                 frameon=False, title=title)  # fmt: skip
    drawn.suptitle(f"{_title(found)}: worst residual after the lock, whatever the other factor is")
    return drawn


def torque_figure(found: Comparison) -> Figure:
    """Torque of all motions on the nominal arm."""
    drawn = Figure(figsize=(8, 4.2), dpi=150, layout="constrained")
    panel = drawn.subplots()
    joint = found.stage.moving[0]
    t = np.linspace(0.0, found.stage.duration, _SAMPLES)
    for done, colour, style in zip(found.outcomes, COLOURS, STYLES, strict=False):
        law = done.solved.torques[joint]
        panel.plot(t, law(t), style, color=colour, label=done.solved.name)
    label_axes(panel, "time [s]", f"{JOINT_NAMES[joint]} torque [N m]")
    panel.legend(frameon=False)
    drawn.suptitle(f"{_title(found)}: torque on the nominal arm")
    return drawn


def _title(found: Comparison) -> str:
    stage = found.stage
    return f"{TITLES[stage.name]} in {stage.duration:.4g} s, {found.spread.drive} drive"
