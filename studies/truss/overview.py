"""A study in one picture: the antenna opening, and what to ask of the motor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from studies.common.drawing import legend_below
from studies.truss.deployment import Deployment
from studies.truss.figures import label_times, styled, times
from studies.truss.snapshots import draw_snapshot

MOMENTS = (0.0, 0.4, 0.6, 1.0)  # of the duration


def overview_figure(deployments: Sequence[Deployment]) -> Figure:
    """Snapshots of the first law above; rope length, acceleration and force of all laws below."""
    first = deployments[0]
    figure = Figure(figsize=(12.0, 5.6), dpi=110, layout="constrained")
    parts: Any = figure.subfigures(2, 1, height_ratios=(1, 1.5))
    above, below = parts
    above.suptitle(f"{first.truss.modules} modules opening under the {first.name} law")
    for place, fraction in enumerate(MOMENTS, start=1):
        panel = above.add_subplot(1, len(MOMENTS), place, projection="3d")
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
