"""What `antenna-ocp turn` is."""

from __future__ import annotations

from studies.common.study import Mechanism, Study, Swept

TURNED = Mechanism(
    title="Stage 2",
    model=(
        "The stowed ring is a rigid hoop on the big arm, which is a torsion spring between it and "
        "a drive whose angle is prescribed.",
    ),
)

STUDY = Study(
    name="turn",
    summary="the folded antenna turned about the axis of the big arm",
    description="Finds the turn with the minimum peak torque in a given time, or with the minimum "
    "time under the caps, from rest to rest of an antenna on an arm that twists. Compares it with "
    "its closed form, and with the paper's laws for the drive.",
    keys={"": "studies.turn.config:TurnStudy"},
    run="studies.turn.study:run",
    check="studies.turn.study:check",
    folder="turn-{0.minimise}",
    resumes=True,
    figures="studies.turn.figures:draw",
    mechanism=TURNED,
    sweep=Swept(seconds=(3.0, 3.0)),
)
