"""Keys of the comparison: the two choices that the paper leaves open and that cost time."""

from __future__ import annotations

from dataclasses import dataclass

from studies.common.configuration import check, key, positive, whole

PAPER_DURATION = 140.0  # [s]; it follows from the printed peak acceleration of Step5


@dataclass(frozen=True, kw_only=True)
class PaperStudy:
    """The paper recomputed: `antenna-ocp paper`.

    Raises
    ------
    StudyError
        Naming the key, its value and the remedy.
    """

    duration: float = key(
        positive,
        "s",
        "of the deployment of the truss, which the paper does not print",
        default=PAPER_DURATION,
    )
    elements: int = key(whole(2, 32), "", "of each link of the arm", default=4)

    def __post_init__(self) -> None:
        check(self)

    @property
    def question(self) -> str:
        """The question, in one line."""
        return "which numbers, tables and figures of the paper do our models give?"
