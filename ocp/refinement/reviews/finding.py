"""What a review is given, and what it finds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from ocp.accuracy import Accuracy
from ocp.estimates.narrow_features import NarrowFeature
from ocp.mesh.mesh import Mesh
from ocp.optimality.iterate import Iterate
from ocp.refinement.endings import Ending
from ocp.refinement.loop import History
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.solved_mesh import SolvedMesh, best_of

Former = Literal["none", "coarser", "as good"]
"""What the former answers are beside those that are found on the way onward.

none     no answers: they are given up for whatever is solved then
coarser  given up for one that holds between its points
as good  kept beside one that holds
"""


@dataclass(frozen=True, eq=False, repr=False)
class Candidate:
    """The best motion of a refinement until now.

    Attributes
    ----------
    meshes : MeshSolver
    accuracy : Accuracy
        That is asked for.
    history : History
        The mesh iterations until now. What a review tries is appended to its records.
    ending : str
        What ended the loop.
    best : SolvedMesh
    """

    meshes: MeshSolver
    accuracy: Accuracy
    history: History
    ending: Ending
    best: SolvedMesh

    @classmethod
    def of(
        cls, meshes: MeshSolver, accuracy: Accuracy, history: History, ending: Ending
    ) -> Candidate:
        """The best one of a history."""
        return cls(meshes, accuracy, history, ending, best_of(history.solved, accuracy))

    @property
    def is_settled(self) -> bool:
        """Whether it holds between its points, and the loop was not cut short."""
        cut = self.ending in ("budget", "rounds")
        return not cut and self.best.is_verifiable(self.accuracy)


@dataclass(frozen=True, eq=False, repr=False)
class Onward:
    """Where a refinement goes on from.

    Attributes
    ----------
    start : Iterate
    mesh : Mesh
        The first one.
    former : str
        What the answers until then are, see `Former`.
    lower : float or None
        The objective of the start, where it is lower beside a saddle [unit of the objective]. It is
        told if no answer comes of it.
    """

    start: Iterate
    mesh: Mesh
    former: Former
    lower: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Found:
    """What a review finds.

    Attributes
    ----------
    onward : Onward or None
        None where the review has nothing against the answer.
    features : tuple of NarrowFeature
        That the points of the answer do not see.
    timed : bool
        Whether its switches were tried at other times, and none gained.
    """

    onward: Onward | None = None
    features: tuple[NarrowFeature, ...] = ()
    timed: bool = False


Review = Callable[[Candidate], Found]
"""Raises KeyboardInterrupt where the user stops what it tries."""
