"""Stage 2, the turn about the big arm's axis: `run(TurnStudy(...))` gives a `Result`."""

from typing import TYPE_CHECKING

from studies.common.late_names import late_names

if TYPE_CHECKING:
    from studies.turn.config import TurnStudy as TurnStudy
    from studies.turn.config import study_from as study_from
    from studies.turn.study import run as run

__getattr__ = late_names(__name__, __file__)
