"""What `antenna-ocp pareto truss` is."""

from __future__ import annotations

from studies.common.study import Study, Swept

STUDY = Study(
    name="pareto truss",
    summary="the trade-off between two objectives of the truss (Pareto front)",
    description="Finds the Pareto front of two objectives of the truss: the minimum of one under "
    "each limit on the other, from both ends, with shadow prices, knee point and gaps, and "
    "compares it with proven bounds and the paper's laws. Every point is a verified motion.",
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
