"""Chains of flexible links for a user: any number of them, each joint free, locked or driven.

A case (`config`) is built into the models' chain (`build`) with a law for each joint (`drives`,
`expressions`), moved with its locks and latches (`motion`), measured (`measures`) and made into a
result (`study`). `presets` are the paper's cases, `examples` others.
"""

from studies.flex.config import FlexStudy, JointCase, LinkCase, study_from
from studies.flex.study import run

__all__ = ["FlexStudy", "JointCase", "LinkCase", "run", "study_from"]
