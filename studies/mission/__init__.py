"""Big arm, small arm and ring within one time budget: `run(MissionStudy(...))` gives a `Result`."""

from typing import TYPE_CHECKING

from studies.common.late_names import late_names

if TYPE_CHECKING:
    from studies.mission.config import MissionStudy as MissionStudy
    from studies.mission.config import study_from as study_from
    from studies.mission.study import run as run

__getattr__ = late_names(__name__, __file__)
