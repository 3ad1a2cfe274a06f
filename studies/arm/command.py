"""What the commands of the arm are, and the mechanism that their results share."""

from __future__ import annotations

from dataclasses import replace

from studies.common.study import Mechanism, Study, Swept

ARM = Mechanism(
    title="Supporting arm",
    model=(
        "Two slender links with a joint at the root and one between them; the antenna is a "
        "particle at the tip. Motions are found on a reduced model with a few elastic coordinates "
        "and replayed on the full model of ANCF beam elements, section III of the paper.",
    ),
    limits=(
        "The arm moves in a plane, without gravity. Its joints have no play and no friction "
        "unless the study gives them.",
    ),
    parameters="studies.arm.report.parameters:parameters_of",
    page="studies.common.scene.links",
)

SOLVE = Study(
    name="arm solve",
    kind="arm",
    summary="a motion of the supporting arm without residual vibration",
    description="Finds a motion of the flexible arm that is at rest at both ends, including the "
    "elastic coordinates, and replays it and the paper's laws on the full ANCF model.",
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
    summary="an optimum for each law, with no higher peak torque",
    description="Replays the paper's laws, a linear torque and shaped torques, and finds for each "
    "an optimum with no higher peak torque.",
    keys={"": "studies.arm.config:BaselinesStudy"},
    folder="arm-{0.stage}-{0.drive}",
    files=None,
    sweep=None,
)
LEAST_DURATION = replace(
    BASELINES,
    name="arm least-duration",
    kind="arm-least-duration",
    summary="minimum durations without residual vibration, of the optimum and each law",
    description="Finds the minimum durations of the optimum and of each law with a residual energy "
    "of at most 1e-6 J, under the peak torque of the Bezier law.",
    keys={"": "studies.arm.config:LeastDurationStudy"},
    folder="arm-{0.stage}-least",
)
SEQUENCE = replace(
    SOLVE,
    name="arm sequence",
    kind="arm-sequence",
    summary="big arm, locked dwell and small arm as one problem",
    description="Solves both stages and the lock between them as one problem with free times: "
    "minimum common peak torque in a total time, or minimum time under a torque cap.",
    keys={"": "studies.arm.config:SequenceStudy"},
    folder="arm-sequence-{0.least}",
    sweep=Swept(),
)
TRADE_OFF = replace(
    BASELINES,
    name="pareto arm",
    kind="pareto-arm",
    summary="the trade-off between two quantities of the arm (Pareto front)",
    description="Finds the Pareto front of two of duration, residual energy, peak torque and "
    "deflection of the arm: the minimum of one under each limit on the other, from both ends, "
    "with shadow prices, knee point and gaps. Every point is replayed on the full model, and its "
    "residual energy is within the allowed one if it is not one of the two.",
    keys={"": "studies.arm.trade_off:TradeOffStudy"},
    folder="arm-{0.stage}-trade-off",
    sweep=Swept(coarse={"coarse": True}, seconds=(300.0, 100.0)),
)
ROBUST = replace(
    BASELINES,
    name="robust arm",
    kind="robust",
    summary="a motion of the arm for a range of stiffness or tip mass",
    description="Finds the motion of minimum peak torque for one arm, and two motions with the "
    "minimum worst residual energy for arms of other stiffness (torque drive) or stiffness and "
    "tip mass (angle drive): one with 10 % more peak torque, and one with no more. Replays them "
    "over the whole range. Exit code 5 if 10 % more torque reduces the worst residual neither to "
    "a fifth nor to 2.5e-7 J.",
    keys={"": "studies.arm.config:RobustStudy"},
    folder="arm-robust-{0.stage}-{0.drive}",
)
