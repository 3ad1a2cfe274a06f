"""What the commands of the arm are, and the mechanism that their results share."""

from __future__ import annotations

from dataclasses import replace

from studies.common.study import Mechanism, Study, Swept

ARM = Mechanism(
    title="Supporting arm",
    model=(
        "Two slender links with a joint at the root and one between them; the antenna is a "
        "particle at the tip. Motions are found on a reduced model with a few elastic coordinates "
        "and replayed on the full one of ANCF beam elements, section III of the paper.",
    ),
    limits=(
        "The arm moves in a plane, without gravity. Its joints have no play and no friction unless "
        "the study says so.",
    ),
    parameters="studies.arm.report.parameters:parameters_of",
    page="studies.common.scene.links",
)

SOLVE = Study(
    name="arm solve",
    kind="arm",
    summary="a motion of the supporting arm that leaves it still",
    description="Finds a motion of the flexible arm that rests at both ends, elastic coordinates "
    "included, and replays it on the full ANCF model, as it does the paper's laws.",
    keys={"": "studies.arm.config:ArmStudy"},
    state="studies.arm.config:as_dictionary",
    check="studies.arm.study:check",
    run="studies.arm.study:run",
    folder="arm-{0.stage}",
    resumes=True,
    ends=True,
    files="studies.arm.report.profile:files",
    figures="studies.arm.report.comparison_figures:draw",
    mechanism=ARM,
    sweep=Swept(coarse={"elements": 4}, seconds=(20.0, 8.0)),
)
BASELINES = replace(
    SOLVE,
    name="arm baselines",
    kind="arm-baselines",
    summary="for each law an optimum of no higher peak torque",
    description="Replays the paper's laws, a linear torque and shaped ones, and finds for each an "
    "optimum of no higher peak torque.",
    keys={"": "studies.arm.config:BaselinesStudy"},
    folder="arm-{0.stage}-{0.drive}",
    files=None,
    sweep=None,
)
LEAST_DURATION = replace(
    BASELINES,
    name="arm least-duration",
    kind="arm-least-duration",
    summary="least durations that leave the arm still, of the optimum and each law",
    description="Finds the least durations of the optimum and of each law that leave at most 1e-6 "
    "J under the Bezier law's peak torque.",
    keys={"": "studies.arm.config:LeastDurationStudy"},
    folder="arm-{0.stage}-least",
)
SEQUENCE = replace(
    SOLVE,
    name="arm sequence",
    kind="arm-sequence",
    summary="big arm, locked dwell and small arm as one problem",
    description="States both stages and the lock between them as one problem whose times are free: "
    "least common peak torque in a total time, or least time under a torque cap.",
    keys={"": "studies.arm.config:SequenceStudy"},
    folder="arm-sequence-{0.least}",
    sweep=Swept(),
)
TRADE_OFF = replace(
    BASELINES,
    name="pareto arm",
    kind="pareto-arm",
    summary="what less of one quantity of the arm costs in another",
    description="Finds the front of two of duration, residual energy, peak torque and deflection "
    "of the arm: the least of one under each limit on the other, from both ends, with prices, knee "
    "and gaps. Every point was replayed on the full model, and leaves it still where the residual "
    "energy is not traded.",
    keys={"": "studies.arm.trade_off:TradeOffStudy"},
    folder="arm-{0.stage}-trade-off",
    sweep=Swept(coarse={"coarse": True}, seconds=(300.0, 100.0)),
)
ROBUST = replace(
    BASELINES,
    name="robust arm",
    kind="robust",
    summary="a motion of the arm that withstands a spread of stiffness or tip mass",
    description="Finds the motion of least peak torque of one arm, and two that leave arms of "
    "other stiffness (torque drive) or stiffness and tip mass (angle drive) as still as can be: "
    "with a tenth more peak torque, and with no more. Replays all over the spread. Exit code 5 if "
    "a tenth more torque brings the worst residual neither to a fifth nor to 2.5e-7 J.",
    keys={"": "studies.arm.config:RobustStudy"},
    folder="arm-robust-{0.stage}-{0.drive}",
)
