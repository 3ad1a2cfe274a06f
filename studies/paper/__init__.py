"""The paper beside ours: every number, table and figure of its text, recomputed.

`entries` says what a row is and how its verdict is found. The rows of the paper's sections are in
`sections`: `flexible_model` (III), `truss_model` (IV), `planning` (V-A), `arms` (V-B) and
`dynamics` (V-C), from the motions of `cases`. `study` makes one result of them, `listing` texts and
tables.
"""

from studies.paper.config import PaperStudy
from studies.paper.study import run

__all__ = ["PaperStudy", "run"]
