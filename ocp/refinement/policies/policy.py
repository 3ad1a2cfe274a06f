"""Mesh policies: from what is wrong with a solved mesh to the next mesh.

A policy of one's own is an object with the members of `MeshPolicy`, handed over as
``Settings(refinement=...)``. `AdaptiveMesh` is the default, `FixedMesh` solves once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Integral
from typing import ClassVar, Protocol, runtime_checkable

from ocp.accuracy import Accuracy
from ocp.errors import StatementError
from ocp.keywords import as_written, checked_keywords
from ocp.mesh.mesh import Mesh
from ocp.refinement.solved_mesh import SolvedMesh

# To which refinement may raise the degree of a mesh by default
HIGHEST_DEGREE = 8


@runtime_checkable
class MeshPolicy(Protocol):
    """What `ocp.solve` asks of a policy."""

    @property
    def adapts(self) -> bool:
        """Whether it ever changes a mesh; an answer on a fixed mesh is returned as it is."""
        ...

    @property
    def rounds(self) -> int:
        """Most meshes that are solved."""
        ...

    @property
    def highest_degree(self) -> int:
        """Highest degree of an interval, to which the first mesh may be raised too."""
        ...

    def next_mesh(self, solved: Sequence[SolvedMesh], accuracy: Accuracy) -> Mesh | None:
        """The mesh after those solved so far, or None when the last one is good enough."""
        ...

    def after_failure(
        self, solved: Sequence[SolvedMesh], failed: Mesh, accuracy: Accuracy
    ) -> tuple[MeshPolicy, Mesh] | None:
        """Policy and mesh to go on with where the solver failed on a mesh; None to end there."""
        ...


def check_counts(policy: object, what: str, *names: str) -> None:
    """StatementError for a field of a policy that is no positive integer."""
    for name in names:
        value = getattr(policy, name)
        if not isinstance(value, Integral) or value < 1:
            raise StatementError(
                f"the number '{name}' of {what} is {value!r}; give a positive integer"
            )


@checked_keywords()
@dataclass(frozen=True, repr=False)
class FixedMesh:
    """No refinement: the first mesh is solved once.

    Parameters
    ----------
    highest_degree : int
        To which the degree of the first mesh may be raised where that integrates the dynamics
        exactly.

    Raises
    ------
    StatementError
        For a number that is no positive integer.
    """

    highest_degree: int = HIGHEST_DEGREE

    adapts: ClassVar[bool] = False
    rounds: ClassVar[int] = 1

    def __repr__(self) -> str:
        return as_written(self)

    def __post_init__(self) -> None:
        check_counts(self, "a fixed mesh", "highest_degree")

    def next_mesh(self, solved: Sequence[SolvedMesh], accuracy: Accuracy) -> Mesh | None:
        """None, whatever was solved."""
        return None

    def after_failure(
        self, solved: Sequence[SolvedMesh], failed: Mesh, accuracy: Accuracy
    ) -> tuple[MeshPolicy, Mesh] | None:
        """None: there is no other mesh."""
        return None
