"""Anyone's profile: read, its noise smoothed, and held against caps, models and optima."""

from studies.common.study import Study
from studies.truss.command import RING

STUDY = Study(
    name="check",
    summary="check a profile of your own, measured or hand-made, against caps and model",
    description="Reads the profile in any common format, estimates its noise and smooths it if "
    "necessary, evaluates it between its rows on the model of the truss or of the arm, and "
    "compares it with the optimum of the same duration and caps and with the paper's laws. Lists "
    "every check and cap that fails, by how much, and when.",
    keys={"": "studies.truss.config:TrussStudy"},
    run="studies.truss.study:run",
    also={"check-arm": "studies.arm.command:ARM"},
    figures="studies.check.figures:draw",
    answers="profile",
    mechanism=RING,
    command="studies.check.command",
)
