"""Programs without the unknowns that chains of integrators leave no choice.

The solver gets a smaller program: the polynomials of `ocp.transcription.courses` take the place of
chained
states within the intervals, one equation at the right end that of their dynamics, and a row each
that of bounds on them inside.  All else keeps to the plain program, see
`ocp.transcription.condensed`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.transcription.condensed import Condensed, Part, Pull
from ocp.transcription.courses import Chains, chains_of, value
from ocp.transcription.kernels import Block, Program, RowName
from ocp.transcription.limits import Limits
from ocp.transcription.substituted import (
    pull_slopes,
    replaced,
    restricted,
    rows_kernel,
    slots_of,
    used_locals,
)
from ocp.transcription.variables import PhaseLayout

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
Kernels = dict[tuple[Any, ...], Any]


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


class _Maker:
    """Makes the blocks of a condensed program out of the plain ones; unknowns keep their ids."""

    def __init__(
        self, chains: Sequence[Chains], left_out: Flags, determined: Flags, constants: ca.SX,
        kernels: Kernels,
    ) -> None:  # fmt: skip
        self.chains, self.left_out, self.determined = chains, left_out, determined
        self.constants, self.kernels = constants, kernels
        self.pulls: list[list[Pull]] = [[] for _ in chains]
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
        used = used_locals(block.kernel, kept)
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
            slots = slots_of([columns[:, p] for p in np.flatnonzero(used)], own.size)
            same: tuple[Any, ...] = ("restricted", block.kernel, tuple(kept), slots.places)
            if same not in self.kernels:
                self.kernels[same] = restricted(block.kernel, used, slots, kept)
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
        slots = slots_of([*(columns[:, p] for p in others), *arguments], own.size)
        key = ("condensed", block.kernel, chains.kind, tuple(kept), tuple(positions),
               tuple(states), slots.places)  # fmt: skip
        if key not in self.kernels:
            self.kernels[key] = (
                replaced(block.kernel, chains, needed, others, positions, states, slots, kept,
                         self.constants),
                pull_slopes(block.kernel, positions, kept),
            )  # fmt: skip
        kernel, slopes = self.kernels[key]
        self.pulls[index[0]].append(Pull(slopes, columns, data, rows, k, nodes, states))
        tau = chains.group.scheme.points[nodes]
        return Block(block.name, kernel, slots.columns, np.hstack([data, tau, chains.widths[k]]),
                     rows, _unnamed, block.native)  # fmt: skip

    def ends(self, chains: Chains, rows: Integers) -> Block:
        """States at the right ends equal their polynomials."""
        every = range(len(chains.states))
        slots = slots_of([*chains.right.T, *chains.arguments(tuple(every))], len(chains.right))
        key = ("ends", chains.kind, slots.places)
        if key not in self.kernels:
            w, width = ca.SX.sym("w", slots.columns.shape[1]), ca.SX.sym("h")
            right, arguments = slots.split(w, len(chains.states))
            found = self._course(chains)(ca.vertcat(*arguments), width, self.constants)
            self.kernels[key] = rows_kernel(
                w, width, self.constants, ca.vertcat(*right) - found[:, -1]
            )
        return Block("ends of chains", self.kernels[key], slots.columns, chains.widths, rows,
                     _unnamed)  # fmt: skip

    def bounds(self, chains: Chains, rows: Integers) -> list[Block]:
        """Rows in place of the bounds of unknowns left out; `rows` by unknown, -1 for none."""
        inside = rows[chains.inside]
        bounded = np.flatnonzero((inside >= 0).any(axis=(0, 1)))
        if not bounded.size:
            return []
        every = range(len(chains.states))
        slots = slots_of(chains.arguments(tuple(every)), len(chains.right))
        key = ("bounds", chains.kind, tuple(bounded), slots.places)
        if key not in self.kernels:
            w, width = ca.SX.sym("w", slots.columns.shape[1]), ca.SX.sym("h")
            _, arguments = slots.split(w, 0)
            found = self._course(chains)(ca.vertcat(*arguments), width, self.constants)
            self.kernels[key] = rows_kernel(
                w, width, self.constants, ca.vec(found[bounded.tolist(), :-1])
            )
        return [Block("bounds within", self.kernels[key], slots.columns, chains.widths,
                      inside[:, :, bounded].reshape(len(inside), -1), _unnamed)]  # fmt: skip

    def part(self, chains: Chains, dynamics: Integers, ends: Integers) -> Part:
        """What it takes to get back to the plain program."""
        arguments = chains.arguments(range(len(chains.states)))
        key = ("gains", chains.kind)
        if key not in self.kernels:
            self.kernels[key] = ca.Function("gains", [self.constants], [chains.gains])
        return Part(chains, np.stack(arguments, axis=1), self._course(chains), self.kernels[key],
                     dynamics, ends, tuple(self.pulls[self.chains.index(chains)]))  # fmt: skip

    def _course(self, chains: Chains) -> ca.Function:
        """See `Part.course`."""
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
