"""What `antenna-ocp paper` is."""

from __future__ import annotations

from studies.common.study import Mechanism, Study

STUDY = Study(
    name="paper",
    summary="every number and figure of the paper compared with ours",
    description="Recomputes every number, table, formula and figure of the paper's text with our "
    "models: printed value, ours, the difference, and a verdict in each row. Exit code 5 if the "
    "basis of a verdict was not found.",
    keys={"": "studies.paper.config:PaperStudy"},
    run="studies.paper.study:run",
    resumes=True,
    files="studies.paper.listing:files",
    outcome="studies.paper.listing:outcome_text",
    figures="studies.paper.figures:draw",
    mechanism=Mechanism(
        title="The paper compared with our models",
        model=("All models of the project for which the paper prints a number.",),
        page="studies.common.scene.links",
    ),
)
