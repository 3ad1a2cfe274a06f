"""What `antenna-ocp mission` is."""

from __future__ import annotations

from studies.common.study import Mechanism, Study

STUDY = Study(
    name="mission",
    summary="big arm, turn, small arm and ring within one time",
    description="Divides the time of the whole deployment among its stages, with the minimum "
    "utilisation: the largest fraction of a cap that any stage uses. Or finds the minimum total "
    "time under the caps. Reports the effect of the ring's reaction on the arm, for three laws.",
    keys={"": "studies.mission.config:MissionStudy"},
    run="studies.mission.study:run",
    folder="mission-{0.least}",
    resumes=True,
    figures="studies.mission.figures:draw",
    answers="parts",
    mechanism=Mechanism(title="Mission", page="studies.common.scene.links"),
)
