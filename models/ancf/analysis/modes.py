"""Static equilibrium, natural frequencies and mode shapes of a chain in any configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from scipy.linalg import eigh

from models.ancf.assembly import dense
from models.ancf.chain import Chain
from models.ancf.joints import Driven, Joint, Locked
from models.ancf.motion.minimal_coordinates import MinimalCoordinates
from models.ancf.state import NodalState, check_start
from models.arrays import Array
from models.errors import ModelError

_COARSE = pi / 2  # wave number times element length: four elements a wave
_ITERATIONS = 60


@dataclass(frozen=True, eq=False)
class Modes:
    """Natural modes, rigid motions left out.

    Attributes
    ----------
    frequencies : (k,)
        [Hz]
    shapes : (size, k)
        Node coordinates, of unit modal mass.
    axial_fraction : (k,)
        Share of the strain energy that stretches the links: near 1 for an axial mode.
    """

    frequencies: Array
    shapes: Array
    axial_fraction: Array

    @property
    def bending(self) -> Array:
        """Frequencies of the modes that mostly bend [Hz]."""
        return self.frequencies[self.axial_fraction < 0.5]

    @property
    def axial(self) -> Array:
        """Frequencies of the modes that mostly stretch [Hz]."""
        return self.frequencies[self.axial_fraction >= 0.5]


def natural_modes(
    chain: Chain, joints: Sequence[Joint], state: NodalState, *, count: int = 6, t: float = 0.0
) -> Modes:
    """Linearise about an equilibrium and return its `count` lowest modes that are not rigid.

    Parameters
    ----------
    chain : Chain
    joints : sequence of Joint
        Free, Torque: hinged. Locked, Driven: held at the angle at time `t`.
    state : NodalState
        An equilibrium, for instance from `posed` or `equilibrium`; its velocity is not used.
    count : int
        Number of modes.
    t : float
        [s]

    Raises
    ------
    ModelError
        If the state is no equilibrium, or the mesh has fewer than four elements a wave at the
        highest frequency asked for.
    """
    form, _, x, lack = _at_rest(chain, joints, state, t)
    asm, ties = form.assembly, form.ties
    scale = max(k.bending_stiffness / k.length**2 for k in chain.links)
    unbalanced = float(np.abs(ties.pull(np.full(1, t), x[:, None], lack[:, None])).max())
    if unbalanced > 1e-5 * scale:
        raise ModelError(
            f"natural_modes: the state is no equilibrium, {unbalanced:.2e} N are unbalanced; "
            "find one with equilibrium(...) first."
        )
    stiffness = ties.reduce(t, x, asm.tangent(x)) + ties.curvature(t, lack)
    mass = ties.reduce(t, x, dense(asm.mass))
    squares, vectors = eigh(stiffness, mass)
    rigid = _rigid_motions(chain, joints)
    squares, vectors = squares[rigid : rigid + count], vectors[:, rigid : rigid + count]
    if len(squares) < count:
        raise ModelError(
            f"natural_modes: {count} modes asked of a mesh that has {len(squares)}; "
            f"use more than {chain.elements} elements a link."
        )
    if squares[0] <= 0.0:
        raise ModelError(
            f"natural_modes: the equilibrium is unstable, omega^2 is {squares[0]:.3g} 1/s^2; "
            "linearise about a stable one."
        )
    _check_mesh(chain, sqrt(squares[-1]))
    shapes = ties.jacobian(t, x) @ vectors
    stretch = (asm.slope @ shapes).reshape(2, len(asm.axial), -1)
    strain = ((asm.slope @ x).reshape(2, -1, 1) * stretch).sum(axis=0)
    share = (asm.weight * asm.axial) @ strain**2 / squares
    return Modes(np.sqrt(squares) / (2 * pi), asm.spread(shapes), share)


def equilibrium(
    chain: Chain, joints: Sequence[Joint], guess: NodalState, *, t: float = 0.0
) -> NodalState:
    """Static equilibrium near a guess, under gravity and the joint torques at time `t`.

    Newton's method with the axial forces as unknowns beside the coordinates.

    Raises
    ------
    ModelError
        If it does not converge, or the chain can move freely.
    """
    form, z, x, _ = _at_rest(chain, joints, guess, t)
    asm, mechanics, ties = form.assembly, form.mechanics, form.ties
    at, zero = np.full(1, t), np.zeros((form.size, 1))
    pull = mechanics.pulls(mechanics.slopes(x[:, None]), 0 * x[:, None])
    for _ in range(_ITERATIONS):
        force, gap = form.residual(at, z, zero, zero, pull)
        form.linearise(t, z[:, 0])
        x = form.motion(at, z, zero, zero)[0][:, 0]
        tangent = ties.reduce(t, x, asm.tangent(x, pull[:, 0]))
        dz = _checked_solve(tangent, form.pull_force(gap) - force)
        dz *= min(1.0, 0.3 / float(np.abs(dz).max(initial=1e-300)))
        z, pull = z + dz, pull + form.pull_change(dz) - gap
        if np.abs(dz).max() < 1e-12:
            q, v = form.nodes(at, z, zero)
            return NodalState(q[:, 0], v[:, 0])
    raise ModelError(
        f"equilibrium: no convergence in {_ITERATIONS} iterations, the last change is "
        f"{np.abs(dz).max():.1e} m; start nearer, or apply the load in steps."
    )


def _rigid_motions(chain: Chain, joints: Sequence[Joint]) -> int:
    """Number of motions that store no energy."""
    if any(chain.gravity):
        return 0
    hinged = sum(not isinstance(joint, Locked | Driven) for joint in joints)
    return hinged if chain.pinned else hinged + 2


def _checked_solve(matrix: Array, rhs: Array) -> Array:
    """Solve, leaving out motions without stiffness unless a force acts along them."""
    stiffness, shapes = eigh(matrix)
    stiff = np.abs(stiffness) > 1e-14 * np.abs(stiffness).max()
    along = shapes.T @ rhs
    if np.abs(along[~stiff]).max(initial=0.0) > 1e-9 * max(1.0, float(np.abs(along).max())):
        raise ModelError(
            "equilibrium: the chain can move without force along a load; lock a joint, or start "
            "nearer the equilibrium."
        )
    return np.asarray(shapes[:, stiff] @ (along[stiff] / stiffness[stiff, None]))


def _at_rest(
    chain: Chain, joints: Sequence[Joint], state: NodalState, t: float
) -> tuple[MinimalCoordinates, Array, Array, Array]:
    """Equations, coordinates z (n_z, 1) and x (n,), and static balance of forces on x (n,)."""
    form = MinimalCoordinates(chain, joints)
    at = np.full(1, t)
    z = form.state(t, state.q, 0 * state.v)[0][:, None]
    zero = np.zeros_like(z)
    kept = form.nodes(at, z, zero)[0][:, 0]
    still = NodalState(state.q, 0 * state.v)
    check_start(chain, joints, still, NodalState(kept, 0 * kept), t)
    x = form.motion(at, z, zero, zero)[0]
    slope, rest = form.mechanics.slopes(x), np.zeros_like(x)
    pull = form.mechanics.pulls(slope, rest)
    return form, z, x[:, 0], form.mechanics.balance(at, x, rest, rest, slope, pull)[:, 0]


def _check_mesh(chain: Chain, omega: float) -> None:
    """Raise ModelError unless every link has four elements a wave at `omega` [rad/s]."""
    needed = 1
    for link in chain.links:
        rho = link.linear_density
        bend = (omega**2 * rho / link.bending_stiffness) ** 0.25
        stretch = omega * sqrt(rho / link.axial_stiffness)
        needed = max(needed, int(np.ceil(max(bend, stretch) * link.length / _COARSE)))
    if chain.elements < needed:
        raise ModelError(
            f"natural_modes: {chain.elements} elements a link are too coarse for "
            f"{omega / (2 * pi):.4g} Hz; use at least {needed}, or ask for fewer modes."
        )
