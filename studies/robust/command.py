"""What `antenna-ocp robust truss` is."""

from __future__ import annotations

from studies.common.study import Study, Switch

STUDY = Study(
    name="robust truss",
    summary="one motion law of the ring truss for several scenarios",
    description="Finds the law with the minimum rope force in the worst of several scenarios: "
    "friction, springs, net, masses, a joint that sticks. Replays it and the nominal optimum on "
    "thousands of random trusses, and reports how often each violates a limit.",
    keys={"robust": "studies.robust.config:Uncertainty", "": "studies.truss.config:TrussStudy"},
    without=("drive",),
    switches={
        "--coarse": Switch(
            "one start on a coarse mesh",
            {"solver.intervals": 24, "solver.starts": ["bezier"]},
        )
    },
    read="studies.robust.config:study_from",
    state="studies.robust.config:as_dictionary",
    check="studies.robust.search:check",
    run="studies.robust.study:run",
    resumes=True,
    figures="studies.robust.figures:draw",
    mechanism="studies.truss.command:RING",
)
