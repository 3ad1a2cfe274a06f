"""Trade-offs as studies: `run(ParetoStudy(...))` gives a `Result` whose axis is the front.

What is listed here is loaded when it is asked for, so that the command starts without the models.
"""

from typing import TYPE_CHECKING

from studies.common.late_names import late_names

if TYPE_CHECKING:
    from studies.fronts.figures import draw as draw
    from studies.pareto.config import ParetoStudy as ParetoStudy
    from studies.pareto.config import study_from as study_from
    from studies.pareto.study import run as run

__getattr__ = late_names(__name__, __file__)
