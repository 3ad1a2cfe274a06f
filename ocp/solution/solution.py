"""What a solve returns."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ocp.arrays import Array
from ocp.errors import StatementError
from ocp.mesh.evaluation import Evaluator
from ocp.mesh.mesh import Mesh, distinct
from ocp.mesh.trajectory import Trajectory
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import Multipliers
from ocp.problem.functionals import Peak
from ocp.problem.lookup import named
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import resolve, scalar
from ocp.refinement.error_estimate import dense_peak
from ocp.refinement.mesh_iteration import MeshIteration
from ocp.verification.simulation import SimulatedMotion
from ocp.verification.verify import Verification

if TYPE_CHECKING:
    from ocp.analysis.one_sided import Sided
    from ocp.analysis.scaling_report import ScalingReport

Kept = TypeVar("Kept")


@dataclass(frozen=True, eq=False)
class Solution:
    """A verified trajectory and how it came about.

    Attributes
    ----------
    objective : value of what was minimised or maximised, as the solver reports it.
    trajectory, replayed : the solution and its independent replay; with `verify=False` there is
        none, `replayed` is the solution and `replay` has no phases.
    mesh_iterations : the mesh rounds.
    verdict : "global: bound met", "local: ..." or "unverified", in words.
    multipliers : of dynamics (costates), bounds, links and peaks, in the units of the statement.
    iterate : the solved program's unknowns and multipliers, for proofs.
    """

    problem: Problem
    objective: float
    trajectory: Trajectory
    replayed: Trajectory
    replay: SimulatedMotion
    verification: Verification
    mesh: Mesh
    mesh_iterations: tuple[MeshIteration, ...]
    verdict: str
    evaluator: Evaluator
    seconds: float = 0.0
    multipliers: Multipliers | None = None
    iterate: Iterate | None = None

    @property
    def breakpoints(self) -> Array:
        """Times of the mesh, all phases [s]."""
        return distinct(np.concatenate([p.breakpoints for p in self.trajectory.phases]))

    @property
    def iterations(self) -> int:
        """Iterations of the solver over all rounds."""
        return sum(r.iterations for r in self.mesh_iterations)

    def __reduce__(self) -> tuple[Any, ...]:
        from ocp.solution.storage import packed, unpacked

        return unpacked, (Solution, packed({f.name: getattr(self, f.name) for f in fields(self)}))

    def value(self, expression: Any, *, replayed: bool = False) -> float:
        """One number: an expression of functionals, unknowns and constants, or its name.

        Peaks and integrals are evaluated densely, between the points too; with `replayed` along
        the independent replay.
        """
        source = self._source(replayed)
        expression = named(self.problem, expression)
        symbols = resolve(scalar(expression, "an expression"), "an expression")
        peaks = {f: dense_peak(self.evaluator, source, f) for f in symbols if isinstance(f, Peak)}
        return self.evaluator.number(source, expression, peaks)

    def sample(
        self, expression: Any, times: Any, phase: Phase | str | None = None, *,
        replayed: bool = False,
    ) -> Array:  # fmt: skip
        """An expression of signals, or its name, at times [s], shape of `times`.

        At an instant shared by two phases the later one answers unless `phase` says otherwise.
        With `replayed`, states come from the independent replay.
        """
        t = np.asarray(times, dtype=float)
        flat, source = t.ravel(), self._source(replayed)
        result = np.full(flat.size, np.nan)
        names = [p.name for p in self.problem.phases]
        if phase is not None:
            names = [phase if isinstance(phase, str) else phase.name]
        for name in names:
            own = source.phase(name)
            slack = 1e-9 * (1.0 + abs(own.end - own.start))
            here = (flat >= own.start - slack) & (flat <= own.end + slack)
            if here.any():
                k, tau = own.locate(np.clip(flat[here], own.start, own.end))
                wanted = named(self.problem, expression, name)
                result[here] = self.evaluator.values(source, name, [wanted], k, tau).ravel()
        if np.isnan(result).any():
            first, last = source.phases[0].start, source.phases[-1].end
            bad = flat[np.isnan(result)][0]
            if not first <= bad <= last:
                raise StatementError(f"{bad} s lies outside the motion ({first} to {last} s)")
        return result.reshape(t.shape)

    def _source(self, replayed: bool) -> Trajectory:
        """The solution or its replay; StatementError if that was not asked for."""
        if replayed and not self.replay.phases:
            raise StatementError(
                "this solution was made with verify=False and has no replay; solve with verify=True"
            )
        return self.replayed if replayed else self.trajectory

    def costate(self, state: Any, times: Any, phase: Phase | str | None = None) -> Array:
        """The costate of a state (or running integral) at times [s], shape of `times`.

        In the sign of `ocp.optimality.costates`: the change of the optimum, as it is minimised,
        per unit
        added to the state.  At an instant shared by two phases the later one answers unless
        `phase` says otherwise.
        """
        t, result = np.asarray(times, dtype=float), np.full(np.size(times), np.nan)
        flat, name = t.ravel(), state if isinstance(state, str) else state.name
        wanted = phase.name if isinstance(phase, Phase) else phase
        for adjoint in self.kept_multipliers.costates:
            if name not in adjoint.names or wanted not in (None, adjoint.name):
                continue
            own = self.trajectory.phase(adjoint.name)
            slack = 1e-9 * (1.0 + abs(own.end - own.start))
            here = (flat >= own.start - slack) & (flat <= own.end + slack)
            k, tau = own.locate(np.clip(flat[here], own.start, own.end))
            result[here] = adjoint.local(k, tau)[:, adjoint.names.index(name)]
        if np.isnan(result).any():
            raise StatementError(f"'{name}' has no costate at {flat[np.isnan(result)][0]} s")
        return result.reshape(t.shape)

    @property
    def scaling(self) -> ScalingReport:
        """The sizes by which the solve divided, and why; prints as a table."""
        from ocp.analysis.scaling_report import report_of

        return report_of(self.problem, self.kept_iterate.scales)

    def sensitivities(self) -> dict[str, float]:
        """Change of the optimum per unit of every named number, see `ocp.analysis.sensitivity`.

        Warns
        -----
        ActiveSetWarning
            Where the optimum has a kink; the number is then nan.
        """
        from ocp.analysis.one_sided import single

        return single(self.one_sided_sensitivities())

    def one_sided_sensitivities(self) -> dict[str, Sided]:
        """The same for a decrease and for an increase of the number.

        See `ocp.analysis.one_sided`.
        """
        from ocp.analysis.one_sided import one_sided

        return one_sided(self.kept_iterate)

    @property
    def kept_iterate(self) -> Iterate:
        """The solved program; StatementError if the solution was made without."""
        return _kept(self.iterate)

    @property
    def kept_multipliers(self) -> Multipliers:
        """The multipliers; StatementError if the solution was made without."""
        return _kept(self.multipliers)


def _kept(what: Kept | None) -> Kept:
    if what is None:
        raise StatementError("this solution was made without its multipliers; solve again")
    return what
