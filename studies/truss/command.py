"""What `antenna-ocp truss` is, and the mechanism that its results share with others."""

from __future__ import annotations

from studies.common.study import Mechanism, Study, Swept

RING = Mechanism(
    title="Ring truss",
    model=(
        "A ring of identical modules that open together. The deployment angle lies between a "
        "vertical bar and its cross-bars. Two ropes, each wound in by a motor, pull the sliders "
        "towards the bars' ends against springs, the cable net and friction; the net is taut from "
        "a certain angle on.",
        "Equations (16) to (38) of Lu, Qi, Hu, Li and Zhang, Deployment Dynamics of Large Space "
        "Antenna and Supporting Arms, IEEE Access 2019, DOI 10.1109/ACCESS.2019.2918614, with "
        "corrections of misprints, which the documents list.",
    ),
    limits=(
        "The truss moves with one degree of freedom: its rods are rigid, all modules move alike, "
        "and clearance and thermal effects are left out.",
        "Gravity is left out, as in orbit.",
        "The section and the elastic modulus of the tubes and the masses of the joints are "
        "assumed: the paper does not give them.",
        "Forces in the bars are those of pinned, rigid bars in a ring whose centre rests: the "
        "fixed bar's reaction also moves the ring as a whole and bends it.",
        "The motor is on the fixed bar; the paper does not give its place.",
    ),
    parameters="studies.truss.parameters:parameters_of",
    page="studies.truss.scene",
    motion="studies.export.source:of_a_truss",
)

STUDY = Study(
    name="truss",
    summary="optimal deployment of the ring truss",
    description="Finds the optimal deployment of the ring truss under caps, compares it with the "
    "laws of the paper, verifies it, and writes its profile and figures.",
    keys={"": "studies.truss.config:TrussStudy"},
    read="studies.truss.config:study_from",
    state="studies.truss.config:as_dictionary",
    check="studies.truss.search.proofs:check_some_optimum",
    run="studies.truss.study:run",
    folder="{0.name}",
    resumes=True,
    figures="studies.truss.figures:draw",
    mechanism=RING,
    sweep=Swept(
        coarse={"solver.intervals": 12, "solver.starts": ["bezier"]}, seconds=(6.0, 1.5), warm=True
    ),
)
