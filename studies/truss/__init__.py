"""The optimal deployment of the ring truss, as a study: `run(TrussStudy(...))` gives a `Result`.

What is listed here is loaded when it is asked for, so that the command starts without the models.
"""

from typing import TYPE_CHECKING

from studies.common.late_names import late_names

if TYPE_CHECKING:
    from studies.truss.config import SolverOptions as SolverOptions
    from studies.truss.config import TrussStudy as TrussStudy
    from studies.truss.config import study_from as study_from
    from studies.truss.figures import draw as draw
    from studies.truss.limits.caps import Caps as Caps
    from studies.truss.study import run as run

__getattr__ = late_names(__name__, __file__)
