"""Numbers of the forces in all bars of the ring along a motion, and what self-stress may change.

Pin forces leave one freedom: a shear that is the same in all modules. The assembly of the ring
decides it, and no statics. All forces are linear in it.

Symbols: alpha [rad], omega [rad/s], acc [rad/s^2]; m samples of a motion, n modules.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from itertools import combinations

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array, elementwise
from models.truss.bar_forces import KINDS, bar_forces
from models.truss.dynamics import rope_force
from models.truss.parameters import TrussParameters


@dataclass(frozen=True, eq=False)
class RingForces:
    """Forces in the bars of all modules along a motion, the shear's mean being zero.

    Attributes
    ----------
    bars : axial forces of each of `KINDS` [N], (m, n, 2), compression positive; the last axis is
        the left and the right half of a module. The lower face has the same forces.
    slopes : how each grows with a self-stress [-], (m, 2), alike in all modules.
    vertical_bar : axial force at its middle, behind each module [N], (m, n).
    crank_moment : that bends a cross-bar at its crank [N m], (m, n, 2).
    """

    bars: dict[str, Array]
    slopes: dict[str, Array]
    vertical_bar: Array
    crank_moment: Array

    def largest(self, *kinds: str) -> Array:
        """Largest push or pull in the bars of these kinds, by default of `KINDS` [N], (m,)."""
        return np.max([np.abs(self.bars[kind]).max(axis=(1, 2)) for kind in kinds or KINDS], axis=0)

    def least_largest(self, *kinds: str) -> Array:
        """The same with the self-stress that makes it least at each sample [N], (m,).

        The forces of one slope move together, and only their largest counts. The least of the
        maximum lies where one that rises with the self-stress crosses one that falls.
        """
        lines = []
        for kind in kinds or KINDS:
            for half in (0, 1):
                forces, slope = self.bars[kind][:, :, half], self.slopes[kind][:, half]
                lines += [(forces.max(axis=1), slope), (-forces.min(axis=1), -slope)]
        return np.max([_crossing(*one, *other) for one, other in combinations(lines, 2)], axis=0)

    def reversal(self) -> float:
        """Of the largest push and the largest pull of a link, the smaller; most of all links [N].

        A link that is both pushed and pulled crosses the play of its joints in between.
        """
        links = self.bars["link"]
        both = np.minimum(links.max(axis=0), -links.min(axis=0))
        return max(float(both.max()), 0.0)


def ring_forces(
    parameters: TrussParameters, angle: ArrayLike, speed: ArrayLike, acceleration: ArrayLike
) -> RingForces:
    """Forces in all bars along a motion of angle, speed, acceleration, shape (m,), speed >= 0."""
    motion = [np.asarray(one, dtype=float)[:, None] for one in (angle, speed, acceleration)]
    modules = np.arange(1.0, parameters.modules + 1)[None, :]
    rows = [row.ravel() for row in np.broadcast_arrays(*motion, modules)]
    shape = (motion[0].size, parameters.modules)

    found = [one.ravel().reshape(shape) for one in elementwise(_kernel(parameters), *rows)]
    halves = [np.stack(found[k : k + 2], axis=-1) for k in range(0, 14, 2)]
    return RingForces(
        bars=dict(zip(KINDS, halves[:3], strict=True)),
        slopes={kind: half[:, 0] for kind, half in zip(KINDS, halves[4:], strict=True)},
        vertical_bar=found[14],
        crank_moment=halves[3],
    )


@functools.lru_cache(maxsize=8)
def _kernel(parameters: TrussParameters) -> ca.Function:
    """Angle, speed, acceleration and module to the forces, and slopes by self-stress."""
    names = ("alpha", "omega", "acc", "module", "shear")
    alpha, omega, acc, module, shear = (ca.SX.sym(name) for name in names)
    force = rope_force(parameters, alpha, omega, acc)
    forces = bar_forces(parameters, alpha, omega, acc, force, module, self_stress=shear)

    bars = [half for kind in forces[:3] for half in kind]
    slopes = [ca.jacobian(half, shear) for half in bars]
    rows = [*bars, *forces.crank_moment, *slopes, forces.vertical_bar]
    still = [ca.substitute(ca.SX(row), shear, 0) for row in rows]
    motion, dense = [alpha, omega, acc, module], [ca.densify(row) for row in still]
    kernel: ca.Function = ca.Function("ring", motion, dense, {"cse": True})
    return kernel


def _crossing(one: Array, rise: Array, other: Array, fall: Array) -> Array:
    """Height (m,) at which two lines cross, if one rises and the other falls, or is flat."""
    steep = np.abs(rise) + np.abs(fall)
    crosses = (rise * fall <= 0) & (steep > 0)
    height = one * np.abs(fall) + other * np.abs(rise)
    return np.where(crosses, height / np.where(crosses, steep, 1.0), -np.inf)
