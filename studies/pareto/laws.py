"""What fronts and surfaces of the truss are held against: the paper's laws, and their axes."""

from __future__ import annotations

from collections.abc import Sequence

from studies.pareto.columns import FrontAxis
from studies.truss.checks import broken_caps
from studies.truss.config import TrussStudy
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import paper_laws
from studies.truss.quantities import QUANTITIES


def axis_of(name: str) -> FrontAxis:
    """An objective as an axis."""
    return FrontAxis(name, QUANTITIES[name].title, QUANTITIES[name].unit)


def laws_in(truss: TrussStudy, duration: float) -> tuple[Deployment, Deployment]:
    """The paper's laws in a duration [s]."""
    return paper_laws(truss.truss, duration, truss.drive, truss.margin)


def broken_titles(truss: TrussStudy, law: Deployment, limited: Sequence[str]) -> tuple[str, ...]:
    """Titles of the caps that a law breaks, all but those on what is limited."""
    broken = broken_caps(truss, law.values)
    return tuple(QUANTITIES[key].title for key in broken if key not in limited)
