"""What `antenna-ocp pareto truss` is."""

from __future__ import annotations

from studies.common.study import Study, Swept

STUDY = Study(
    name="pareto truss",
    summary="what less of one objective of the truss costs in another",
    description="Finds the front of two objectives of the truss: the least of one under each limit "
    "on the other, from both ends, with prices, knee and gaps, and compares it with proven bounds "
    "and the paper's laws. Every point is a verified motion.",
    keys={"pareto": "studies.pareto.config:TradeOff", "": "studies.truss.config:TrussStudy"},
    without=("minimise",),
    read="studies.pareto.config:study_from",
    state="studies.pareto.config:as_dictionary",
    check="studies.pareto.study:check",
    run="studies.pareto.study:run",
    folder="{0.name}",
    resumes=True,
    figures="studies.fronts.figures:draw",
    motions="studies.pareto.motions:motion_of",
    mechanism="studies.truss.command:RING",
    sweep=Swept(coarse={"pareto.coarse": True}, seconds=(100.0, 30.0)),
)
