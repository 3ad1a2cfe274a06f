"""Sweeps: one study of the truss, the arm or a chain, solved for many values of its keys.

`config` is what the user states, `subjects` what can be swept. `cases` plans the cases and keeps
one file of each; `workers` solves them in processes of their own; `driver` hands them out.
"""

from typing import TYPE_CHECKING

from studies.common.late_names import late_names
from studies.common.study import Mechanism, Study

if TYPE_CHECKING:
    from studies.sweep.config import SweepStudy as SweepStudy
    from studies.sweep.config import study_from as study_from
    from studies.sweep.figures import draw as draw

__getattr__ = late_names(__name__, __file__)

STUDY = Study(
    name="sweep",
    summary="one study for many values of its keys: grids, lists, samples",
    description="Solves a study of the truss, the arm, a chain or another package for many values "
    "of any of its keys, each case in a process of its own, and keeps one file a case: killed at "
    "any moment, the same command goes on. Writes a tidy table and draws curves, heat maps or a "
    "tornado. Exit code 5 if a case ended without an answer.",
    keys={"": "studies.sweep.config:SweepStudy"},
    run="studies.sweep.cases.plan:plan",
    figures="studies.sweep.figures:draw",
    drawn=True,
    answers="cases",
    mechanism=Mechanism(title="Many cases of one study"),
    command="studies.sweep.command",
)
