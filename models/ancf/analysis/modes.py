"""Static equilibrium, natural frequencies and mode shapes of a chain in any configuration.

Symbols: x coordinates of the assembly (n,), z minimal coordinates (n_z,), N axial forces (G,) [N],
omega angular frequency [rad/s].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from models.ancf.assembly import dense
from models.ancf.chain import Chain
from models.ancf.joints import Driven, Joint, Locked
from models.ancf.motion import MinimalCoordinates
from models.ancf.state import NodalState
from models.arrays import Array
from models.errors import ModelError, require

_COARSE = pi / 2  # wave number times element length: four elements a wave
_ITERATIONS = 60
_CONVERGED = 1e-12  # last change of a coordinate [m, -]
_LONGEST_STEP = 0.3  # of a coordinate [m, -]: a large rotation is taken in parts
# Forces that an equilibrium may leave unbalanced, over the bending force EI/L^2: more than the
# rounding of axial forces, far less than what would show in a frequency.
_UNBALANCED = 1e-5


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
    chain: Chain,
    joints: Sequence[Joint],
    state: NodalState,
    *,
    count: int = 6,
    t: float = 0.0,
    resolved: bool = False,
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
    resolved : bool
        Return fewer where the mesh has fewer than four elements a wave at a higher frequency.

    Raises
    ------
    ModelError
        If the state is no equilibrium, or the mesh has fewer than four elements a wave at the
        highest frequency asked for.
    """
    form = MinimalCoordinates(chain, joints)
    _, x = _configuration(form, state, t)
    lack = _unbalanced_force(form, x, t)
    asm, elimination = form.assembly, form.elimination

    scale = max(link.bending_stiffness / link.length**2 for link in chain.links)
    on_z = elimination.force(np.full(1, t), x[:, None], lack[:, None])
    unbalanced = float(np.abs(on_z).max())
    require(
        unbalanced <= _UNBALANCED * scale,
        f"natural_modes: the state is no equilibrium, {unbalanced:.2e} N are unbalanced; "
        "find one with equilibrium(...) first.",
    )

    stiffness = elimination.reduce(t, x, asm.tangent(x)) + elimination.geometric_stiffness(t, lack)
    mass = elimination.reduce(t, x, dense(asm.mass))
    squares, vectors = _elastic_modes(chain, joints, stiffness, mass, count)
    if resolved:
        fine = sum(_elements_for(chain, sqrt(square)) <= chain.elements for square in squares)
        squares, vectors = squares[: max(fine, 1)], vectors[:, : max(fine, 1)]
    _check_mesh(chain, sqrt(squares[-1]))

    # Half the stiffness times a shape of unit modal mass is its strain energy, omega^2 / 2.
    shapes = elimination.jacobian(t, x) @ vectors
    stretch = (asm.slope @ shapes).reshape(2, len(asm.axial), -1)
    strain = ((asm.slope @ x).reshape(2, -1, 1) * stretch).sum(axis=0)
    axial_fraction = (asm.weight * asm.axial) @ strain**2 / squares
    return Modes(np.sqrt(squares) / (2 * pi), asm.spread(shapes), axial_fraction)


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
    form = MinimalCoordinates(chain, joints)
    instant, still = np.full(1, t), np.zeros((form.size, 1))
    z, x = _configuration(form, guess, t)
    N = form.mechanics.axial_forces(form.mechanics.slopes(x[:, None]), 0 * x[:, None])

    for _ in range(_ITERATIONS):
        force, gap = form.residual(instant, z, still, still, N)
        form.linearise(t, z[:, 0])
        x = form.motion(instant, z, still, still)[0][:, 0]
        tangent = form.elimination.reduce(t, x, form.assembly.tangent(x, N[:, 0]))

        # The axial forces are eliminated from the correction and follow from it.
        dz = _checked_solve(tangent, form.axial_load(gap) - force)
        dz *= min(1.0, _LONGEST_STEP / float(np.abs(dz).max(initial=1e-300)))
        z, N = z + dz, N + form.axial_force_change(dz) - gap
        if np.abs(dz).max() < _CONVERGED:
            q, v = form.nodes(instant, z, still)
            return NodalState(q[:, 0], v[:, 0])

    raise ModelError(
        f"equilibrium: no convergence in {_ITERATIONS} iterations, the last change is "
        f"{np.abs(dz).max():.1e} m; start nearer, or apply the load in steps."
    )


def _configuration(form: MinimalCoordinates, state: NodalState, t: float) -> tuple[Array, Array]:
    """Coordinates z (n_z, 1) and x (n,) of a state taken at rest."""
    kept = form.consistent(state, t, at_rest=True)
    z = form.coordinates(t, kept.q, kept.v)[0][:, None]
    still = np.zeros_like(z)
    return z, form.motion(np.full(1, t), z, still, still)[0][:, 0]


def _unbalanced_force(form: MinimalCoordinates, x: Array, t: float) -> Array:
    """Static balance of forces on x (n,) [N]: zero, or the reactions of ties, at equilibrium."""
    columns, still = x[:, None], np.zeros((len(x), 1))
    slope = form.mechanics.slopes(columns)
    N = form.mechanics.axial_forces(slope, still)
    return form.mechanics.balance(np.full(1, t), columns, still, still, slope, N)[:, 0]


def _elastic_modes(
    chain: Chain, joints: Sequence[Joint], stiffness: Array, mass: Array, count: int
) -> tuple[Array, Array]:
    """The `count` lowest omega^2 [1/s^2] and their shapes, rigid motions left out."""
    from scipy.linalg import eigh

    # ascending, so rigid motions come first, with zero but for rounding
    squares, vectors = eigh(stiffness, mass)
    rigid = _rigid_motions(chain, joints)
    squares, vectors = squares[rigid : rigid + count], vectors[:, rigid : rigid + count]

    require(
        len(squares) == count,
        f"natural_modes: {count} modes asked of a mesh that has {len(squares)}; "
        f"use more than {chain.elements} elements a link.",
    )
    require(
        squares[0] > 0.0,
        f"natural_modes: the equilibrium is unstable, omega^2 is {squares[0]:.3g} 1/s^2; "
        "linearise about a stable one.",
    )
    return squares, vectors


def _rigid_motions(chain: Chain, joints: Sequence[Joint]) -> int:
    """Number of motions that store no energy."""
    if any(chain.gravity):
        return 0
    hinged = sum(not isinstance(joint, Locked | Driven) for joint in joints)
    return hinged if chain.pinned else hinged + 2


def _checked_solve(matrix: Array, rhs: Array) -> Array:
    """Solve, leaving out motions without stiffness unless a force acts along them."""
    from scipy.linalg import eigh

    # In the basis of its eigenvectors the system is diagonal.
    stiffness, shapes = eigh(matrix)
    stiff = np.abs(stiffness) > 1e-14 * np.abs(stiffness).max()
    along = shapes.T @ rhs

    loose = float(np.abs(along[~stiff]).max(initial=0.0))
    require(
        loose <= 1e-9 * max(1.0, float(np.abs(along).max())),
        "equilibrium: the chain can move without force along a load; lock a joint, or start "
        "nearer the equilibrium.",
    )
    return np.asarray(shapes[:, stiff] @ (along[stiff] / stiffness[stiff, None]))


def _elements_for(chain: Chain, omega: float) -> int:
    """Elements with which every link has four of them a wave at `omega` [rad/s]."""
    needed = 1
    for link in chain.links:
        rho = link.linear_density

        # wave numbers of a beam that bends and of a rod that stretches at this frequency
        bend = (omega**2 * rho / link.bending_stiffness) ** 0.25
        stretch = omega * sqrt(rho / link.axial_stiffness)
        needed = max(needed, int(np.ceil(max(bend, stretch) * link.length / _COARSE)))
    return needed


def _check_mesh(chain: Chain, omega: float) -> None:
    """Raise ModelError unless the elements are enough for `omega` [rad/s]."""
    needed = _elements_for(chain, omega)
    if chain.elements < needed:
        raise ModelError(
            f"natural_modes: {chain.elements} elements a link are too coarse for "
            f"{omega / (2 * pi):.4g} Hz; use at least {needed}, or ask for fewer modes."
        )
