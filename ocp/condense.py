"""Programs without the unknowns that chains of integrators leave no choice.

The solver gets a smaller program: the polynomials of `ocp.courses` take the place of chained
states within the intervals, one equation at the right end that of their dynamics, and a row each
that of bounds on them inside.  All else keeps to the plain program: what is found is expanded to
it, multipliers included, which stationarity by the unknowns left out determines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.blocks import Block, Kernel, Program, RowName
from ocp.courses import Chains, chains_of, value
from ocp.ipopt import Duals, NlpResult
from ocp.layout import PhaseLayout
from ocp.limits import Limits

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
Kernels = dict[tuple[Any, ...], Any]


@dataclass(frozen=True, eq=False)
class _Pull:
    """What some instances of a block add to the slopes by the states that polynomials replace.

    Attributes
    ----------
    slopes : ``(w, d, c, multipliers of the rows) ->`` slopes by the local variables replaced.
    columns, data, rows : of the plain program's block, without the rows that are left out.
    intervals : (k,) place of the instances among the group's intervals.
    nodes, states : (r,) or (k, r) support point, from 0 within, and number of the chained state.
    """

    slopes: ca.Function
    columns: Integers
    data: Array
    rows: Integers
    intervals: Integers
    nodes: Integers
    states: Integers

    def add(self, total: Array, x: Array, constants: Array, multipliers: Array) -> None:
        """Add to (m, s, n) slopes."""
        found = self.slopes(
            x[self.columns].T, self.data.T, constants, multipliers[self.rows].T
        ).full().T  # fmt: skip
        np.add.at(total, (self.intervals[:, None], self.nodes, self.states[None, :]), found)


@dataclass(frozen=True, eq=False)
class _Part:
    """The chains of a group within a condensed program.

    Attributes
    ----------
    course : ``(arguments, width, constants) ->`` (n, s) scaled states at the support points but
        the left.
    gains : ``constants ->`` (n, n) of each state by each other, scaled, over a unit length.
    dynamics : (m, s, n) rows of the plain program that are left out.
    ends : (m, n) rows of the condensed program in their place.
    """

    chains: Chains
    arguments: Integers
    course: ca.Function
    gains: ca.Function
    dynamics: Integers
    ends: Integers
    pulls: tuple[_Pull, ...]

    def inside(self, x: Array, constants: Array) -> Array:
        """(m, s - 1, n) unknowns left out, from those that are there."""
        m, s, n = self.dynamics.shape
        found = self.course(x[self.arguments].T, self.chains.widths.T, constants).full().T
        return found.reshape(m, s, n)[:, :-1]

    def slopes(self, x: Array, constants: Array, multipliers: Array) -> Array:
        """(m, s, n) slopes of the rows that are kept by the states that polynomials replace."""
        total = np.zeros(self.dynamics.shape)
        for pull in self.pulls:
            pull.add(total, x, constants, multipliers)
        return total

    def matrix(self, x: Array, constants: Array) -> Array:
        """(m, s n, s n) slopes of the dynamics by the states at all support points but the left."""
        s, n = self.dynamics.shape[1:]
        given = x[self.arguments] * self.chains.sizes[self.arguments]
        clock = given[:, given.shape[1] - self.chains.clocks :].T
        lengths = self.chains.length(list(clock), self.chains.widths[:, 0])
        rates = np.kron(np.eye(s), np.array(self.gains(constants)))
        fixed = np.kron(self.chains.group.scheme.derivative[:, 1:], np.eye(n))
        return np.asarray(fixed - lengths[:, None, None] * rates)


@dataclass(frozen=True, eq=False)
class Condensed:
    """A condensed program and the way back to the plain one.

    Attributes
    ----------
    columns, rows : unknowns and rows of the plain program that are kept, first and in order.
    bounded, bounds : bounded unknowns that are left out, and the rows in place of their bounds.
    """

    plain: Program
    program: Program
    columns: Integers
    rows: Integers
    bounded: Integers
    bounds: Integers
    parts: tuple[_Part, ...]

    def limits(
        self, columns: tuple[Array, Array], rows: tuple[Array, Array]
    ) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Limits of unknowns and rows, from those of the plain program."""
        found = []
        for column, row in zip(columns, rows, strict=True):
            side = np.zeros(self.program.rows)
            side[: self.rows.size] = row[self.rows]
            side[self.bounds] = column[self.bounded]
            found.append((column[self.columns], side))
        (low, under), (high, over) = found
        return (low, high), (under, over)

    def duals(self, duals: Duals, x: Array, constants: Array) -> Duals:
        """Multipliers, from those of the plain program at a point of it."""
        rows = np.zeros(self.program.rows)
        rows[: self.rows.size] = duals.rows[self.rows]
        rows[self.bounds] = duals.columns[self.bounded]
        for part in self.parts:
            m, s, n = part.dynamics.shape
            own = duals.rows[part.dynamics].reshape(m, 1, s * n)
            pulled = (own @ part.matrix(x, constants)).reshape(m, s, n)
            pulled += part.slopes(x, constants, duals.rows)
            rows[part.ends] = pulled[:, -1]
        return Duals(duals.columns[self.columns], rows)

    def point(self, x: Array, constants: Array) -> Array:
        """The plain program's unknowns."""
        found = np.zeros(self.plain.variables)
        found[self.columns] = x
        for part in self.parts:
            found[part.chains.inside] = part.inside(found, constants)
        return found

    def expanded(
        self, result: NlpResult, columns: tuple[Array, Array], constants: Array
    ) -> NlpResult:
        """A result in terms of the plain program, whose column limits are given."""
        if not self.parts:
            return result
        x = self.point(result.x, constants)
        bounds, rows = np.zeros(self.plain.variables), np.zeros(self.plain.rows)
        bounds[self.columns] = result.bound_multipliers
        bounds[self.bounded] = result.row_multipliers[self.bounds]
        rows[self.rows] = result.row_multipliers[: self.rows.size]
        for part in self.parts:
            m, s, n = part.dynamics.shape
            pulled = -part.slopes(x, constants, rows)
            pulled[:, :-1] -= bounds[part.chains.inside]
            pulled[:, -1] += result.row_multipliers[part.ends]
            transposed = part.matrix(x, constants).transpose(0, 2, 1)
            solved = np.linalg.solve(transposed, pulled.reshape(m, s * n, 1))
            rows[part.dynamics] = solved.reshape(m, s, n)
        values = np.zeros(self.plain.rows)
        values[self.rows] = result.rows[: self.rows.size]
        if result.outcome != "solved":  # what is violated shows in rows that a user knows
            x = np.clip(x, *columns)
            values = np.array(self.plain.oracle(x, constants)[1]).ravel()
        return replace(result, x=x, rows=values, bound_multipliers=bounds, row_multipliers=rows)


def condense(
    blocks: Sequence[Block], layouts: Sequence[PhaseLayout], plain: Program, columns: Limits,
    sizes: Array, constants: ca.SX, kernels: Kernels,
) -> Condensed:  # fmt: skip
    """The condensed form of a program.

    Parameters
    ----------
    columns, sizes : limits and sizes of the unknowns.
    constants : (c,) symbols of the problem's constants.
    kernels : those of other programs of the problem; new ones are added.
    """
    found = [c for layout in layouts for c in chains_of(layout, sizes)]
    if not found:
        every = np.arange(plain.variables), np.arange(plain.rows)
        none = np.empty(0, dtype=np.int64)
        return Condensed(plain, plain, *every, none, none, ())
    dynamics = [_dynamics(blocks, chains) for chains in found]
    left_out = np.zeros(plain.variables, dtype=bool)
    determined = np.zeros(plain.rows, dtype=bool)
    for chains, rows in zip(found, dynamics, strict=True):
        left_out[chains.inside], determined[rows] = True, True
    kept_columns, kept_rows = np.flatnonzero(~left_out), np.flatnonzero(~determined)
    bounded = np.flatnonzero(left_out & columns.bounded)
    maker = _Maker(found, left_out, determined, constants, kernels)
    made = [piece for block in blocks for piece in maker.pieces(block)]
    row_ids = np.cumsum(~determined) - 1
    smaller = [replace(b, rows=row_ids[b.rows]) for b in made]
    count, parts = kept_rows.size, []
    for chains, rows in zip(found, dynamics, strict=True):
        ends = count + np.arange(chains.right.size).reshape(chains.right.shape)
        count += ends.size
        smaller.append(maker.ends(chains, ends))
        parts.append(maker.part(chains, rows, ends))
    bounds = np.full(plain.variables, -1)
    bounds[bounded] = count + np.arange(bounded.size)
    smaller += [b for chains in found for b in maker.bounds(chains, bounds)]
    ids = np.cumsum(~left_out) - 1
    program = Program(
        tuple(replace(b, columns=ids[b.columns]) for b in smaller),
        kept_columns.size, count + bounded.size, plain.constants,
    )  # fmt: skip
    return Condensed(
        plain, program, kept_columns, kept_rows, bounded, bounds[bounded], tuple(parts)
    )


def _dynamics(blocks: Sequence[Block], chains: Chains) -> Integers:
    """(m, s, n) rows of the dynamics of the chained states."""
    name = f"{chains.layout.phase.name}: collocation"
    own = [b for b in blocks if b.name == name][
        [g is chains.group for g in chains.layout.groups].index(True)
    ]
    m, s = chains.group.support.shape[0], chains.group.scheme.degree
    return own.rows[:, chains.numbers].reshape(m, s, -1)


def _unnamed(instance: int, row: int) -> RowName:
    return RowName("a condensed row")


@dataclass(frozen=True, eq=False)
class _Slots:
    """Local variables of a kernel, each once: their columns (k, slots), and where each goes."""

    columns: Integers
    places: tuple[int, ...]


def _slots(columns: Sequence[Integers], count: int) -> _Slots:
    """Slots of the columns (count,) that were asked for."""
    known: dict[bytes, int] = {}
    places = [known.setdefault(np.ascontiguousarray(c).tobytes(), len(known)) for c in columns]
    first = [places.index(i) for i in range(len(known))]
    unique = [columns[i][:, None] for i in first]
    return _Slots(np.hstack([np.empty((count, 0), dtype=np.int64), *unique]), tuple(places))


class _Maker:
    """Makes the blocks of a condensed program out of the plain ones; unknowns keep their ids."""

    def __init__(
        self, chains: Sequence[Chains], left_out: Flags, determined: Flags, constants: ca.SX,
        kernels: Kernels,
    ) -> None:  # fmt: skip
        self.chains, self.left_out, self.determined = chains, left_out, determined
        self.constants, self.kernels = constants, kernels
        self.pulls: list[list[_Pull]] = [[] for _ in chains]
        self.home = np.full((left_out.size, 4), -1)  # chains, interval, node, state
        for i, own in enumerate(chains):
            m, s, n = own.inside.shape
            grid = np.stack(np.meshgrid(i, np.arange(m), np.arange(s), np.arange(n),
                                        indexing="ij"), axis=-1)[0]  # fmt: skip
            self.home[own.inside] = grid

    def pieces(self, block: Block) -> list[Block]:
        """A block without what is left out; instances that differ in it go apart."""
        gone = self.determined[block.rows[0]]
        if not gone.any() and not self.left_out[block.columns].any():
            return [block]
        kept = np.flatnonzero(~gone)
        if not kept.size and not block.kernel.costs:
            return []
        used = _used(block.kernel, kept)
        masks, which = np.unique(
            self.left_out[block.columns] & used, axis=0, return_inverse=True
        )  # fmt: skip
        return [
            self._piece(block, np.flatnonzero(which.ravel() == i), mask, used, kept)
            for i, mask in enumerate(masks)
        ]

    def _piece(
        self, block: Block, own: Integers, mask: Flags, used: Flags, kept: Integers
    ) -> Block:
        """The instances `own` of a block, local variables of `mask` replaced by polynomials."""
        columns, data = block.columns[own], block.data[own]
        rows = block.rows[own][:, kept]
        if not mask.any():
            slots = _slots([columns[:, p] for p in np.flatnonzero(used)], own.size)
            same: tuple[Any, ...] = ("restricted", block.kernel, tuple(kept), slots.places)
            if same not in self.kernels:
                self.kernels[same] = _restricted(block.kernel, used, slots, kept)
            return Block(block.name, self.kernels[same], slots.columns, data, rows, _unnamed,
                         block.native)  # fmt: skip
        at = np.flatnonzero(mask)
        index, k = self.home[columns[:, at[0]], :2].T
        chains = self.chains[index[0]]
        ends = [
            (p, n) for p in np.flatnonzero(used & ~mask) for n in range(len(chains.states))
            if np.array_equal(columns[:, p], chains.right[k, n])
        ]  # fmt: skip
        positions = np.array([*at, *(p for p, _ in ends)], dtype=np.int64)
        nodes = np.hstack([
            self.home[columns[:, at], 2], np.full((own.size, len(ends)), chains.inside.shape[1])
        ])  # fmt: skip
        states = np.array([*self.home[columns[0, at], 3], *(n for _, n in ends)])
        needed = chains.needed(states)
        others = [int(p) for p in np.flatnonzero(used) if p not in positions]
        arguments = [a[k] for a in chains.arguments(needed)]
        slots = _slots([*(columns[:, p] for p in others), *arguments], own.size)
        key = ("condensed", block.kernel, chains.kind, tuple(kept), tuple(positions),
               tuple(states), slots.places)  # fmt: skip
        if key not in self.kernels:
            self.kernels[key] = (
                _replaced(block.kernel, chains, needed, others, positions, states, slots, kept,
                          self.constants),
                _pull(block.kernel, positions, kept),
            )  # fmt: skip
        kernel, slopes = self.kernels[key]
        self.pulls[index[0]].append(_Pull(slopes, columns, data, rows, k, nodes, states))
        tau = chains.group.scheme.points[nodes]
        return Block(block.name, kernel, slots.columns, np.hstack([data, tau, chains.widths[k]]),
                     rows, _unnamed, block.native)  # fmt: skip

    def ends(self, chains: Chains, rows: Integers) -> Block:
        """States at the right ends equal their polynomials."""
        every = range(len(chains.states))
        slots = _slots([*chains.right.T, *chains.arguments(tuple(every))], len(chains.right))
        key = ("ends", chains.kind, slots.places)
        if key not in self.kernels:
            w, width = ca.SX.sym("w", slots.columns.shape[1]), ca.SX.sym("h")
            right, arguments = _split(w, slots, len(chains.states))
            found = self._course(chains)(ca.vertcat(*arguments), width, self.constants)
            self.kernels[key] = _kernel(w, width, self.constants, ca.vertcat(*right) - found[:, -1])
        return Block("ends of chains", self.kernels[key], slots.columns, chains.widths, rows,
                     _unnamed)  # fmt: skip

    def bounds(self, chains: Chains, rows: Integers) -> list[Block]:
        """Rows in place of the bounds of unknowns left out; `rows` by unknown, -1 for none."""
        inside = rows[chains.inside]
        bounded = np.flatnonzero((inside >= 0).any(axis=(0, 1)))
        if not bounded.size:
            return []
        every = range(len(chains.states))
        slots = _slots(chains.arguments(tuple(every)), len(chains.right))
        key = ("bounds", chains.kind, tuple(bounded), slots.places)
        if key not in self.kernels:
            w, width = ca.SX.sym("w", slots.columns.shape[1]), ca.SX.sym("h")
            _, arguments = _split(w, slots, 0)
            found = self._course(chains)(ca.vertcat(*arguments), width, self.constants)
            self.kernels[key] = _kernel(
                w, width, self.constants, ca.vec(found[bounded.tolist(), :-1])
            )
        return [Block("bounds within", self.kernels[key], slots.columns, chains.widths,
                      inside[:, :, bounded].reshape(len(inside), -1), _unnamed)]  # fmt: skip

    def part(self, chains: Chains, dynamics: Integers, ends: Integers) -> _Part:
        """What it takes to get back to the plain program."""
        arguments = chains.arguments(range(len(chains.states)))
        key = ("gains", chains.kind)
        if key not in self.kernels:
            self.kernels[key] = ca.Function("gains", [self.constants], [chains.gains])
        return _Part(chains, np.stack(arguments, axis=1), self._course(chains), self.kernels[key],
                     dynamics, ends, tuple(self.pulls[self.chains.index(chains)]))  # fmt: skip

    def _course(self, chains: Chains) -> ca.Function:
        """See `_Part.course`."""
        key = ("course", chains.kind)
        if key not in self.kernels:
            every = range(len(chains.states))
            w, width = ca.SX.sym("w", len(chains.arguments(every))), ca.SX.sym("h")
            found = chains.courses(every, ca.vertsplit(w), width)
            values = ca.vertcat(*[
                ca.horzcat(*[value(found[i], float(t)) / float(chains.scales[i])
                             for t in chains.group.scheme.points])
                for i in every
            ])  # fmt: skip
            self.kernels[key] = ca.Function("course", [w, width, self.constants], [values])
        return self.kernels[key]


def _split(w: ca.SX, slots: _Slots, first: int) -> tuple[list[ca.SX], list[ca.SX]]:
    """Local variables in the order in which they were asked for, the first apart."""
    every = [w[i] for i in slots.places]
    return every[:first], every[first:]


def _kernel(w: ca.SX, d: ca.SX, c: ca.SX, rows: ca.SX) -> Kernel:
    none = ca.SX(0, 1)
    return Kernel(
        ca.Function("outer", [w, none, d, c], [ca.SX(1, 1), ca.densify(rows)]),
        ca.Function("inner", [w, d], [none]),
    )


def _used(kernel: Kernel, kept: Integers) -> Flags:
    """Which local variables the objective and the rows kept depend on."""
    found = np.zeros(kernel.outer.size1_in(0), dtype=bool)
    rows, variables = kernel.pattern
    found[variables[np.isin(rows, kept)]] = True
    if kernel.costs:
        found[np.array(kernel.whole.jac_sparsity(0, 0).get_triplet()[1], dtype=np.int64)] = True
    return found


def _restricted(kernel: Kernel, used: Flags, slots: _Slots, kept: Integers) -> Kernel:
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


def _replaced(
    kernel: Kernel, chains: Chains, needed: tuple[int, ...], others: Sequence[int],
    positions: Integers, states: Integers, slots: _Slots, kept: Integers, c: ca.SX,
) -> Kernel:  # fmt: skip
    """A kernel with polynomials in the place of some local variables."""
    w, d_old = ca.SX.sym("w", slots.columns.shape[1]), ca.SX.sym("d", kernel.outer.size1_in(2))
    tau, width = ca.SX.sym("tau", positions.size), ca.SX.sym("h")
    d = ca.vertcat(d_old, tau, width)
    own, arguments = _split(w, slots, len(others))
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


def _pull(kernel: Kernel, positions: Integers, kept: Integers) -> ca.Function:
    """See `_Pull.slopes`."""
    w, _, d, c = kernel.symbols()
    lam = ca.SX.sym("lam", kept.size)
    f, g = kernel.whole(w, d, c)
    slopes = ca.gradient(f + ca.dot(lam, g[kept.tolist()]), w)
    return ca.Function("pull", [w, d, c, lam], [ca.densify(slopes[positions.tolist()])])
