"""What `antenna-ocp mission` is."""

from __future__ import annotations

from studies.common.study import Mechanism, Study

STUDY = Study(
    name="mission",
    summary="big arm, turn, small arm and ring within one time",
    description="Shares the time of the whole deployment out among its stages, so "
    "that the largest part of any cap that a stage uses is least; or finds the least total time "
    "under the caps. Says what the ring's reaction does to the arm, for three laws.",
    keys={"": "studies.mission.config:MissionStudy"},
    run="studies.mission.study:run",
    folder="mission-{0.least}",
    resumes=True,
    figures="studies.mission.figures:draw",
    answers="parts",
    mechanism=Mechanism(title="Mission", page="studies.common.scene.links"),
)
