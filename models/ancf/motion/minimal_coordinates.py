"""Equations of motion with the constraints eliminated: the coordinates z move freely.

Hinges share a position and a pinned root is dropped (linear, in the assembly); a locked or
driven hinge is a tie, b = g R(phi) a. The equations are J^T (M xddot + grad U - Q) = 0 with
xddot = J zddot + Jdot zdot. Along the chain the matrices are narrow bands.

Symbols: z coordinates (n,), v, a rates and accelerations; x coordinates of the assembly;
q node vector (size,); N axial forces (G,) [N]; J = dx/dz; m, s columns (instants).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from models.ancf.assembly import assemble, dense
from models.ancf.chain import Chain
from models.ancf.joints import Driven, Joint, Locked, check_joints, joint_angles
from models.ancf.joints.elimination import SlopeElimination
from models.ancf.joints.ties import slope_ties
from models.ancf.motion.equations import Mechanics
from models.ancf.state import NodalState
from models.arrays import Array
from models.errors import ModelError, require

# Diagonals on either side: neighbouring nodes, with their hinges, couple over 7 places of the
# order in `assembly`. A tie couples the slope before it with all that the slope after it couples.
_HALF_BAND = 7
_HALF_BAND_TIED = 9


class MinimalCoordinates:
    """The form of the equations used by default; see `EquationsOfMotion`."""

    def __init__(self, chain: Chain, joints: Sequence[Joint]) -> None:
        self.chain = chain
        self.joints = check_joints(chain, joints)
        self.assembly = assemble(chain)
        self.mechanics = Mechanics(chain, self.joints, self.assembly)
        ties = slope_ties(chain, self.joints, self.assembly.place)
        self.elimination = SlopeElimination(ties, self.assembly.size)

        # no multipliers: the accelerations are the only unknowns
        self.size = self.unknowns = len(self.elimination.kept)
        self.relaxation = chain.relaxation_time
        self.factorizations = 0
        self._tied = bool(ties)
        self._band = _Band(self.size, _HALF_BAND_TIED if ties else _HALF_BAND)

    # the coordinates

    def coordinates(self, t: float, q: Array, v: Array) -> tuple[Array, Array]:
        """Z and its velocity of a node vector and its velocity."""
        asm = self.assembly
        return self.elimination.restrict(t, asm.gather(q), asm.gather(v))

    def nodes(self, t: Array, z: Array, v: Array) -> tuple[Array, Array]:
        """Node vectors and velocities (size, m) of z and its velocity (n, m)."""
        x, rate, _ = self.elimination.motion(t, z, v, np.zeros_like(z))
        return self.assembly.spread(x), self.assembly.spread(rate)

    def motion(self, t: Array, z: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """X with velocity and acceleration (n_x, m) of z, its velocity and acceleration."""
        return self.elimination.motion(t, z, v, a) if self._tied else (z, v, a)

    def consistent(self, state: NodalState, t: float, *, at_rest: bool = False) -> NodalState:
        """Return a state at time `t` [s] with all constraints kept to rounding.

        Parameters
        ----------
        state : NodalState
        t : float
            [s]
        at_rest : bool
            True takes the velocities for zero, even where a joint is driven.

        Raises
        ------
        ModelError
            If the state breaks the constraints by more than rounding.
        """
        given = NodalState(state.q, 0 * state.v) if at_rest else state
        z, v = self.coordinates(t, given.q, given.v)
        q_kept, v_kept = (y[:, 0] for y in self.nodes(np.full(1, t), z[:, None], v[:, None]))
        kept = NodalState(q_kept, 0 * v_kept if at_rest else v_kept)

        self._check_angles(given, t)
        _check_gaps(given, kept)
        return kept

    def _check_angles(self, state: NodalState, t: float) -> None:
        """Raise ModelError unless locked and driven joints are at their angles."""
        angles = joint_angles(self.chain, state.q[:, None])[:, 0]
        for k, (joint, angle) in enumerate(zip(self.joints, angles, strict=True)):
            if not isinstance(joint, Locked | Driven):
                continue
            wanted = float(joint.law(np.array([t]))[0][0])
            miss = np.angle(np.exp(1j * (angle - wanted)))  # whole turns do not count
            require(
                abs(miss) <= 1e-9,
                f"simulate: joint {k} starts at {angle:.9g} rad but its {type(joint).__name__} "
                f"law asks for {wanted:.9g} rad; start from a state at that angle.",
            )

    # what the integrator asks

    def residual(self, t: Array, z: Array, v: Array, a: Array, N: Array) -> tuple[Array, Array]:
        x, rate, acc = self.motion(t, z, v, a)
        slope = self.mechanics.slopes(x)
        gap = N - self.mechanics.axial_forces(slope, rate)
        force = self.mechanics.balance(t, x, rate, acc, slope, N)
        return (self.elimination.force(t, x, force) if self._tied else force), gap

    def start(self, t: float, z: Array, v: Array) -> tuple[Array, Array]:
        from scipy.linalg import solve

        instant, z, v = np.full(1, t), z[:, None], v[:, None]
        x, rate, _ = self.motion(instant, z, v, np.zeros_like(z))
        N = self.mechanics.axial_forces(self.mechanics.slopes(x), rate)

        # The residual is linear in the accelerations: without them it is what they balance.
        force, _ = self.residual(instant, z, v, np.zeros_like(z), N)
        mass = self.elimination.reduce(t, x[:, 0], dense(self.assembly.mass))
        return solve(mass, -force[:, 0], assume_a="pos"), N[:, 0]

    def linearise(self, t: float, z: Array) -> None:
        still = np.zeros((self.size, 1))
        x = self.motion(np.full(1, t), z[:, None], still, still)[0]
        self._slope = self.mechanics.slopes(x)

        configuration, elimination = x[:, 0], self.elimination
        self._mass = elimination.reduce(t, configuration, dense(self.assembly.mass))
        tangent = self.assembly.tangent(configuration)
        stiffness = elimination.reduce(t, configuration, tangent)
        self._bands = self._band.pack(self._mass), self._band.pack(stiffness)
        self._jacobian = elimination.jacobian(t, configuration) if self._tied else None

    def factor(self, steps: NDArray[np.complex128]) -> None:
        mass, stiffness = self._bands
        self._factors = []
        for step in steps:
            # a real step is factorised in real arithmetic, which is cheaper
            scale = step**2 + self.relaxation * step
            matrix = mass + (scale if scale.imag else scale.real) * stiffness
            self._factors.append(self._band.factor(matrix))
        self.factorizations += len(steps)

    def solve(self, k: int, rhs: NDArray[Any]) -> NDArray[Any]:
        return self._band.solve(self._factors[k], rhs)

    def axial_force_change(self, dz: Array) -> Array:
        dx = dz if self._jacobian is None else self._jacobian @ dz
        return np.asarray(self.mechanics.axial * (self._slope * self.mechanics.slopes(dx)).sum(0))

    def axial_load(self, N: Array) -> Array:
        force = self.mechanics.axial_load(self._slope, N)
        return force if self._jacobian is None else self._jacobian.T @ force

    def inertia(self, a: Array) -> Array:
        return np.asarray(self._mass @ a)


def _check_gaps(given: NodalState, kept: NodalState) -> None:
    """Raise ModelError unless a state is, but for rounding, the one that keeps the constraints."""
    gap = float(np.abs(given.q - kept.q).max())
    if gap > 1e-8:
        raise ModelError(
            f"simulate: the initial coordinates leave the hinges or the root open by {gap:.2e} m; "
            "start from posed(...) or from a simulated state."
        )

    # relative to the velocities given, which carry the rounding of fast motions
    jump = float(np.abs(given.v - kept.v).max())
    if jump > 1e-7 * max(1.0, float(np.abs(given.v).max())):
        raise ModelError(
            f"simulate: the initial velocities break the constraints by {jump:.2e} m/s; "
            "project them with engage(...) first."
        )


class _Band:
    """LAPACK storage of n x n matrices with `width` diagonals on either side.

    The routines of LAPACK are called directly: `scipy.linalg.solve_banded` would factorise anew
    for every right-hand side.
    """

    def __init__(self, n: int, width: int) -> None:
        from scipy.linalg import lapack

        self._real = lapack.dgbtrf, lapack.dgbtrs
        self._complex = lapack.zgbtrf, lapack.zgbtrs
        self.width = width = min(width, n - 1)

        # Entry (i, j) is stored in row 2 width + i - j of column j; the first `width` rows are
        # room for the row exchanges.
        rows, columns = np.indices((n, n))
        inside = np.abs(rows - columns) <= width
        self._from = rows[inside], columns[inside]
        self._to = 2 * width + rows[inside] - columns[inside], columns[inside]
        self._shape = 3 * width + 1, n

    def pack(self, matrix: Array) -> Array:
        band = np.zeros(self._shape, order="F")
        band[self._to] = matrix[self._from]
        return band

    def factor(self, band: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        routine = (self._complex if np.iscomplexobj(band) else self._real)[0]
        factors, pivots, _ = routine(band, self.width, self.width)
        return factors, pivots

    def solve(self, factors: tuple[NDArray[Any], NDArray[Any]], rhs: NDArray[Any]) -> NDArray[Any]:
        routine = (self._complex if np.iscomplexobj(factors[0]) else self._real)[1]
        return np.asarray(routine(factors[0], self.width, self.width, rhs, factors[1])[0])
