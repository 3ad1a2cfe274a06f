"""What `antenna-ocp codesign` is."""

from __future__ import annotations

from studies.common.study import Study

STUDY = Study(
    name="codesign",
    summary="mechanism and motion of the ring truss as one problem",
    description="Finds the crank, link and springs of the ring truss together with its motion, for "
    "the least rope force. Diameter, end tension of the net, holding force, stroke, stowed height "
    "and largest force in a bar are kept. Each active bound is listed with its shadow price.",
    keys={
        "": "studies.truss.config:TrussStudy",
        "design": "studies.codesign.config:DesignSpace",
    },
    read="studies.codesign.config:study_from",
    state="studies.codesign.config:as_dictionary",
    check="studies.codesign.study:check",
    run="studies.codesign.study:run",
    folder="codesign-{0.objective}",
    resumes=True,
    files="studies.codesign.prices:files",
    figures="studies.codesign.figures:draw",
    mechanism="studies.truss.command:RING",
)
