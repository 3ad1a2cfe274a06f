"""One law for many trusses: `run(RobustTrussStudy(...))` gives a `Result`."""

from typing import TYPE_CHECKING

from studies.common.late_names import late_names

if TYPE_CHECKING:
    from studies.robust.config import RobustTrussStudy as RobustTrussStudy
    from studies.robust.config import Uncertainty as Uncertainty
    from studies.robust.config import study_from as study_from
    from studies.robust.study import run as run

__getattr__ = late_names(__name__, __file__)
