"""How the Hamiltonian and the path constraints of a phase depend on the signals that are tried.

This is a matter of the statement, and the same for all motions and meshes. So it is worked out
once for a problem, each part when it is first asked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from ocp.mesh.trajectory import Evaluator
from ocp.numerics.linearity import is_linear, is_quadratic
from ocp.numerics.polynomial_expressions import polynomial_degree
from ocp.optimality.hamiltonian import hamiltonian_of
from ocp.optimality.iterate import Iterate
from ocp.problem.symbols import Algebraic, Control


@dataclass(frozen=True, eq=False, repr=False)
class ControlDependence:
    """The Hamiltonian and `n_c` path constraints of a phase, as functions of `n_u` tried signals.

    Attributes
    ----------
    inputs : list of SX
        Signals, time, unknowns and constants, and costates.
    value : SX
        The Hamiltonian.
    path : (n_c,) SX
        The constraints that have rows at the collocation points, `paths` of the Hamiltonian.
    columns : tuple of int
        Of the tried signals among all signals.
    """

    inputs: list[ca.SX]
    value: ca.SX
    path: ca.SX
    columns: tuple[int, ...]

    @property
    def tried(self) -> ca.SX:
        """The symbols of the tried signals, (n_u,)."""
        return self.inputs[0][list(self.columns)]

    @cached_property
    def is_straight(self) -> bool:
        """Whether the Hamiltonian and all constraints are linear."""
        return is_linear(self.value, self.tried) and is_linear(self.path, self.tried)

    @cached_property
    def is_square(self) -> bool:
        """Whether the Hamiltonian is a quadratic function, without steps and kinks."""
        return is_quadratic(self.value, self.tried)

    @cached_property
    def changes_shortly(self) -> bool:
        """Whether what controls do to the Hamiltonian may change for a short time, as in a gust.

        It may where time enters their slopes otherwise than as a polynomial.
        """
        slopes = ca.vertsplit(ca.gradient(self.value, self.tried))
        return any(polynomial_degree(slope, [self.inputs[1]], [1]) is None for slope in slopes)

    @cached_property
    def hamiltonian(self) -> ca.Function:
        """``(signals, time, unknowns and constants, costates) -> H``."""
        return ca.Function("hamiltonian_alone", self.inputs, [self.value])

    @cached_property
    def shared(self) -> tuple[tuple[int, ...], ca.Function] | None:
        """Numbers of the constraints in which tried signals are, and these with their slopes.

        None where there are none. The function is ``(signals, time, unknowns and constants) ->
        constraints (k,), slopes by the tried signals (k n_u,)``.
        """
        slopes = ca.jacobian(self.path, self.tried)
        places = [i for i in range(self.path.numel()) if slopes[i, :].nnz() > 0]
        if not places:
            return None
        outputs = [ca.densify(self.path[places]), ca.densify(ca.vec(slopes[places, :]))]
        return tuple(places), ca.Function("limits", self.inputs[:3], ca.cse(outputs))

    @cached_property
    def tied(self) -> tuple[int, ...]:
        """Numbers of linear constraints that tie tried signals to each other by states or by time.

        A cost above a power is tied to the force by the speed.
        """
        signals, time = self.inputs[:2]
        columns = [i for i in range(signals.numel()) if i not in self.columns]
        along = ca.vertcat(signals[columns], time)
        slopes = ca.jacobian(self.path, self.tried)
        shared = [i for i in range(self.path.numel()) if slopes[i, :].nnz() > 1]
        several = [i for i in shared if is_linear(self.path[i], self.tried)]
        return tuple(i for i in several if ca.depends_on(self.path[i], along))

    @cached_property
    def curved(self) -> tuple[int, ...]:
        """Numbers of the constraints that are not linear."""
        every = range(self.path.numel())
        return tuple(i for i in every if not is_linear(self.path[i], self.tried))

    @cached_property
    def curvatures(self) -> ca.Function | None:
        """``(signals, time, unknowns and constants) -> second derivatives (n_u^2,)`` of `curved`.

        None where one of these is no quadratic function.
        """
        if not all(is_quadratic(self.path[i], self.tried) for i in self.curved):
            return None
        second = [ca.densify(ca.vec(ca.hessian(self.path[i], self.tried)[0])) for i in self.curved]
        return ca.Function("curvatures", self.inputs[:3], ca.cse(second))


def tried_signals(iterate: Iterate, index: int) -> tuple[Control | Algebraic, ...]:
    """The controls of phase number `index`, and its algebraic signals, which change with them."""
    columns = iterate.transcription.columns.phases[index]
    return (*columns.controls, *columns.algebraics)


def dependence_on_controls(iterate: Iterate, evaluator: Evaluator, index: int) -> ControlDependence:
    """That of phase number `index` on its `tried_signals`, made once for a problem."""
    signals = iterate.trajectory.phases[index].signals
    columns = tuple(signals.index(signal.name) for signal in tried_signals(iterate, index))

    def made() -> ControlDependence:
        hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
        return ControlDependence(*hamiltonian.expressions(), columns)

    return evaluator.once(("dependence on controls", index, signals, columns), made)


def are_tied(iterate: Iterate, evaluator: Evaluator, index: int) -> bool:
    """Whether several controls share an inequality with states or time in phase number `index`.

    What such controls gain together is no part of `ocp.optimality.control_gains`: there the
    inequality leaves none of them any room.
    """
    dependence = dependence_on_controls(iterate, evaluator, index)
    paths = hamiltonian_of(evaluator, iterate.transcription, index).paths
    constraints = iterate.transcription.constraints[index]
    return any(not constraints[paths[place]].is_equation for place in dependence.tied)
