"""Kernels whose local variables are shared, left out or replaced by polynomials of chains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.transcription.courses import Chains, value
from ocp.transcription.kernels import Kernel

Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Slots:
    """Local variables of a kernel, each once: their columns (k, slots), and where each goes."""

    columns: Integers
    places: tuple[int, ...]

    def split(self, w: ca.SX, first: int) -> tuple[list[ca.SX], list[ca.SX]]:
        """Local variables in the order in which they were asked for, the first apart."""
        every = [w[i] for i in self.places]
        return every[:first], every[first:]


def slots_of(columns: Sequence[Integers], count: int) -> Slots:
    """Slots of the columns (count,) that were asked for."""
    known: dict[bytes, int] = {}
    places = [known.setdefault(np.ascontiguousarray(c).tobytes(), len(known)) for c in columns]
    first = [places.index(i) for i in range(len(known))]
    unique = [columns[i][:, None] for i in first]
    return Slots(np.hstack([np.empty((count, 0), dtype=np.int64), *unique]), tuple(places))


def rows_kernel(w: ca.SX, d: ca.SX, c: ca.SX, rows: ca.SX) -> Kernel:
    """A kernel of rows alone."""
    none = ca.SX(0, 1)
    return Kernel(
        ca.Function("outer", [w, none, d, c], [ca.SX(1, 1), ca.densify(rows)]),
        ca.Function("inner", [w, d], [none]),
    )


def used_locals(kernel: Kernel, kept: Integers) -> Flags:
    """Which local variables the objective and the rows kept depend on."""
    found = np.zeros(kernel.outer.size1_in(0), dtype=bool)
    rows, variables = kernel.pattern
    found[variables[np.isin(rows, kept)]] = True
    if kernel.costs:
        found[np.array(kernel.whole.jac_sparsity(0, 0).get_triplet()[1], dtype=np.int64)] = True
    return found


def restricted(kernel: Kernel, used: Flags, slots: Slots, kept: Integers) -> Kernel:
    """A kernel without some rows and the local variables that they alone depend on."""
    w, d = ca.SX.sym("w", slots.columns.shape[1]), ca.SX.sym("d", kernel.outer.size1_in(2))
    c, y = ca.SX.sym("c", kernel.outer.size1_in(3)), ca.SX.sym("y", kernel.outer.size1_in(1))
    old = ca.SX.zeros(used.size)
    for p, slot in zip(np.flatnonzero(used), slots.places, strict=True):
        old[int(p)] = w[slot]
    f, g = kernel.outer(old, y, d, c)
    return Kernel(
        ca.Function("outer", [w, y, d, c], ca.cse([f, g[kept.tolist()]])),
        ca.Function("inner", [w, d], [kernel.inner(old, d)]),
    )


def replaced(
    kernel: Kernel, chains: Chains, needed: tuple[int, ...], others: Sequence[int],
    positions: Integers, states: Integers, slots: Slots, kept: Integers, c: ca.SX,
) -> Kernel:  # fmt: skip
    """A kernel with polynomials in the place of some local variables."""
    w, d_old = ca.SX.sym("w", slots.columns.shape[1]), ca.SX.sym("d", kernel.outer.size1_in(2))
    tau, width = ca.SX.sym("tau", positions.size), ca.SX.sym("h")
    d = ca.vertcat(d_old, tau, width)
    own, arguments = slots.split(w, len(others))
    courses = chains.courses(needed, arguments, width)
    exact = ca.vertcat(*[
        value(courses[i], tau[n]) / float(chains.scales[i]) for n, i in enumerate(states)
    ])  # fmt: skip
    z = ca.SX.sym("z", positions.size) if chains.linear else exact
    old = ca.SX.zeros(kernel.outer.size1_in(0))
    for p, symbol in zip(others, own, strict=True):
        old[int(p)] = symbol
    for n, p in enumerate(positions):
        old[int(p)] = z[n]
    combined = kernel.inner(old, d_old)
    if not chains.linear:
        none = ca.SX(0, 1)
        f, g = kernel.outer(old, combined, d_old, c)
        return Kernel(
            ca.Function("outer", [w, none, d, c], ca.cse([f, g[kept.tolist()]])),
            ca.Function("inner", [w, d], [none]),
        )
    y = ca.SX.sym("y", combined.numel())
    f, g = kernel.outer(old, y, d_old, c)
    (combined,) = ca.substitute([combined], [z], [exact])
    return Kernel(
        ca.Function("outer", [w, ca.vertcat(y, z), d, c], ca.cse([f, g[kept.tolist()]])),
        ca.Function("inner", [w, d], [ca.densify(ca.vertcat(combined, exact))]),
    )


def pull_slopes(kernel: Kernel, positions: Integers, kept: Integers) -> ca.Function:
    """See `ocp.transcription.condensed.Pull.slopes`."""
    w, _, d, c = kernel.symbols()
    lam = ca.SX.sym("lam", kept.size)
    f, g = kernel.whole(w, d, c)
    slopes = ca.gradient(f + ca.dot(lam, g[kept.tolist()]), w)
    return ca.Function("pull", [w, d, c, lam], [ca.densify(slopes[positions.tolist()])])
