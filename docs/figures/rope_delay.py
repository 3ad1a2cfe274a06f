"""Draws what the truss does if the motor of one rope is 0.1 s behind that of the other."""

import dataclasses

from models.truss import DYNAMIC_SET
from studies.drive.schema import Drive
from studies.truss.motions.laws import paper_laws
from studies.truss.rope_figure import rope_delay_figure

truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=0.01)
drive = Drive(rope_stiffness=600.0, rope_delay=0.1)
rope_delay_figure(paper_laws(truss, 10.0, drive)[0]).savefig("rope_delay.png", dpi=130)
