"""The paper compared with our models: every number, table and figure of its text, recomputed.

`entries` says what a row is and how its verdict is found. The rows of the paper's sections are in
`sections`: `flexible_model` (III), `truss_model` (IV), `planning` (V-A), `arms` (V-B) and
`dynamics` (V-C), from the motions of `cases`. `study` makes one result of them, `listing` texts and
tables.
"""

from typing import TYPE_CHECKING

from studies.common.late_names import late_names

if TYPE_CHECKING:
    from studies.paper.config import PaperStudy as PaperStudy
    from studies.paper.study import run as run

__getattr__ = late_names(__name__, __file__)
