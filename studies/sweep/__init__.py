"""Sweeps: one study of the truss, the arm or a chain, solved for many values of its keys.

`config` has the keys of a sweep, `subjects` the studies that can be swept. `cases` plans the cases
and stores one file of each; `workers` solves them in separate processes; `driver` distributes them.
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
    "of any of its keys. Each case runs in a separate process and is stored in one file, so the "
    "same command resumes an interrupted sweep. Writes a tidy table and draws curves, heat maps or "
    "a tornado. Exit code 5 if a case ended without an answer.",
    keys={"": "studies.sweep.config:SweepStudy"},
    run="studies.sweep.cases.plan:plan",
    figures="studies.sweep.figures:draw",
    drawn=True,
    answers="cases",
    mechanism=Mechanism(title="Many cases of one study"),
    command="studies.sweep.command",
)
