"""What `antenna-ocp flex` is."""

from __future__ import annotations

from pathlib import Path

from studies.common.study import Mechanism, Study, Swept, Switch

STUDY = Study(
    name="flex",
    summary="any chain of flexible links with free, locked or driven joints",
    description="Simulates a chain of ANCF beams from a TOML file: links with sections and "
    "materials, joints that are free, locked or driven by angle or torque, gravity, damping, locks "
    "and latches. The constraints are eliminated, or kept with multipliers. Nothing is optimised. "
    "Exit code 5 if the energy drifts, a constraint is violated, both forms differ or a joint does "
    "not reach its latch.",
    keys={"": "studies.flex.config:FlexStudy"},
    presets=Path(__file__).parent / "presets",
    switches={"--no-sweep": Switch("do not simulate the [sweep] of the case", {"sweep": {}})},
    read="studies.flex.config:study_from",
    state="studies.flex.config:as_dictionary",
    # a CSV file is named from where its case is, and its rows become part of the case
    beside="studies.flex.drives:with_tables",
    check="studies.flex.study:check",
    run="studies.flex.study:run",
    folder="flex-{file}",
    resumes=True,
    figures="studies.flex.figures:draw",
    mechanism=Mechanism(
        title="Flexible links",
        model=(
            "A chain of slender links of ANCF beam elements, section III of the paper, with joints "
            "that are free, locked or driven.",
        ),
        limits=(
            "The links move in a plane and stay elastic. Their joints have no play and no "
            "friction.",
        ),
        parameters="studies.flex.parameters:parameters_of",
        page="studies.flex.page",
    ),
    sweep=Swept(coarse={"elements": 2}, seconds=(10.0, 3.0)),
)
