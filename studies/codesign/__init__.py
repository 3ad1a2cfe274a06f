"""Mechanism and motion of the truss as one problem: `run(CodesignStudy(...))` gives a `Result`."""

from typing import TYPE_CHECKING

from studies.common.late_names import late_names

if TYPE_CHECKING:
    from studies.codesign.config import CodesignStudy as CodesignStudy
    from studies.codesign.config import DesignSpace as DesignSpace
    from studies.codesign.config import study_from as study_from
    from studies.codesign.study import run as run

__getattr__ = late_names(__name__, __file__)
