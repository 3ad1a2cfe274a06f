"""Chains of flexible links for a user: any number of them, each joint free, locked or driven.

A case (`config`) is built into the models' chain (`build`) with a law for each joint (`drives`,
`expressions`), moved with its locks and latches (`motion`), measured (`measures`) and made into a
result (`study`). `presets` are the paper's cases, `examples` others.
"""

from typing import TYPE_CHECKING

from studies.common.late_names import late_names

if TYPE_CHECKING:
    from studies.flex.config import FlexStudy as FlexStudy
    from studies.flex.config import JointCase as JointCase
    from studies.flex.config import LinkCase as LinkCase
    from studies.flex.config import study_from as study_from
    from studies.flex.study import run as run

__getattr__ = late_names(__name__, __file__)
