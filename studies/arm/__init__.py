"""Motions of the supporting arm, as studies: `run(ArmStudy(...))` gives a `Result`.

What is listed here is loaded when it is asked for, so that the command starts without the models.
"""

from typing import TYPE_CHECKING

from studies.common.late_names import late_names

if TYPE_CHECKING:
    from studies.arm.config import ArmStudy as ArmStudy
    from studies.arm.config import BaselinesStudy as BaselinesStudy
    from studies.arm.config import LeastDurationStudy as LeastDurationStudy
    from studies.arm.config import RobustStudy as RobustStudy
    from studies.arm.config import SequenceStudy as SequenceStudy
    from studies.arm.config import study_from as study_from
    from studies.arm.report.comparison_figures import draw as draw
    from studies.arm.study import run as run
    from studies.arm.trade_off import TradeOffStudy as TradeOffStudy
    from studies.common.arm_description import ArmDescription as ArmDescription

__getattr__ = late_names(__name__, __file__)
