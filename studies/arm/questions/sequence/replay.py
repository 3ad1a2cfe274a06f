"""A sequence on the reduced model B21, through both locks."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from models.ancf.joints import Torque
from models.arm.lock import lock_reduced, released
from models.arm.reduced_simulation import simulate_reduced
from studies.arm.replay.full_model import Motion
from studies.arm.replay.reduced_model import method_for
from studies.arm.stage import ELBOW, ROOT

_TOLERANCE = 1e-10


def replay_reduced(motions: Sequence[Motion], dwell: float) -> tuple[float, float]:
    """Energies right after both locks on B21 [J], with a dwell between them [s]."""
    first, second = (motion.stage for motion in motions)
    root, elbow = (motion.joints[k] for k, motion in zip((ROOT, ELBOW), motions, strict=True))
    assert isinstance(root, Torque)
    assert isinstance(elbow, Torque)

    # big arm, up to the lock of the root
    model = first.model
    run = simulate_reduced(
        model,
        model.at(*first.start),
        np.array([0.0, first.duration]),
        root=root,
        tolerance=_TOLERANCE,
        method=method_for(model, first.start, first.duration),
    )
    still, q, v = lock_reduced(model, run.q[:, -1], run.v[:, -1], root=True)
    after_first = sum(float(energy) for energy in still.energies(q, v))

    # locked, then released at the elbow
    run = simulate_reduced(
        still,
        q,
        np.array([0.0, dwell]),
        v=v,
        tolerance=_TOLERANCE,
        method=method_for(still, first.end, dwell),
    )
    free = dataclasses.replace(second.model, root_lock=still.root_lock)
    q, v = released(still, free, run.q[:, -1], run.v[:, -1])

    # small arm, up to the lock of the elbow
    run = simulate_reduced(
        free,
        q,
        np.array([0.0, second.duration]),
        v=v,
        elbow=elbow,
        tolerance=_TOLERANCE,
        method=method_for(free, second.start, second.duration),
    )
    end, q, v = lock_reduced(free, run.q[:, -1], run.v[:, -1], elbow=True)
    return after_first, sum(float(energy) for energy in end.energies(q, v))
