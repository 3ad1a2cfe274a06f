"""A nonlinear program in stages: what a solver for optimal control takes instead of one matrix.

An interval is a stage, and one more at the end holds the objective, bounds and links.  A variable
that several stages use (a state at a breakpoint; a peak, a free time or a parameter throughout) has
a copy in each stage from its first to its last, and each copy equals the one before.  Within a
stage the copies come first: they are its states, the other variables its controls, and the links
its dynamics ``next state = state or control``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.transcription.kernels import Block, Kernel, Program, RowName
from ocp.transcription.variables import PhaseLayout

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Stages:
    """A program in stages, and where the unknowns and rows of the plain one are.

    Attributes
    ----------
    variables : (n,) the plain unknown that each unknown is a copy of.
    linked : (n,) whether an unknown equals one of the stage before.
    rows : (m,) place of each plain row; the places left are links.
    states, controls, paths : (stages,) numbers of unknowns of either kind and of plain rows.
    """

    program: Program
    variables: Integers
    linked: Flags
    rows: Integers
    states: Integers
    controls: Integers
    paths: Integers

    def column_limits(self, limits: tuple[Array, Array]) -> tuple[Array, Array]:
        """Bounds of the unknowns; copies have none."""
        lower, upper = (side[self.variables] for side in limits)
        return np.where(self.linked, -np.inf, lower), np.where(self.linked, np.inf, upper)

    def row_limits(self, limits: tuple[Array, Array]) -> tuple[Array, Array]:
        """Bounds of the rows; links are equations."""
        lower, upper = np.zeros(self.program.rows), np.zeros(self.program.rows)
        lower[self.rows], upper[self.rows] = limits
        return lower, upper

    def plain(self, values: Array) -> Array:
        """Values or multipliers of the plain unknowns."""
        found = np.empty(int(self.variables.max()) + 1)
        found[self.variables[~self.linked]] = values[~self.linked]
        return found


def in_stages(blocks: Sequence[Block], layouts: Sequence[PhaseLayout], program: Program) -> Stages:
    """The program of some blocks, the last of them over end values, in stages."""
    last = sum(layout.intervals for layout in layouts)
    stages = _stages_of(blocks, _homes(layouts, program.variables), last)
    used = [
        np.broadcast_to(s[:, None], b.columns.shape) for b, s in zip(blocks, stages, strict=True)
    ]
    begin, end = _spans([b.columns for b in blocks], used, program.variables)
    lengths = end - begin + 1
    variables = np.repeat(np.arange(program.variables), lengths)
    starts = np.cumsum(lengths) - lengths
    stage = np.arange(lengths.sum()) - np.repeat(starts - begin, lengths)
    linked = stage > begin[variables]
    order = np.lexsort((variables, ~linked, stage))
    place = np.empty(order.size, dtype=np.int64)
    place[order] = np.arange(order.size)

    def find(plain: Integers, at: Integers) -> Integers:
        return np.asarray(place[starts[plain] + at - begin[plain]])

    variables, stage, linked = variables[order], stage[order], linked[order]
    states, controls = (np.bincount(stage[kind], minlength=last + 1) for kind in (linked, ~linked))
    row_stages = np.zeros(program.rows, dtype=np.int64)
    for block, s in zip(blocks, stages, strict=True):
        np.maximum.at(row_stages, block.rows, np.broadcast_to(s[:, None], block.rows.shape))
    paths, following = np.bincount(row_stages, minlength=last + 1), np.append(states[1:], 0)
    first_rows = np.cumsum(paths + following) - (paths + following)
    rows = _ranks(row_stages) + (first_rows + following)[row_stages]
    copies = np.flatnonzero(linked)
    before = find(variables[copies], stage[copies] - 1)
    link_rows = _ranks(stage[copies]) + first_rows[stage[copies] - 1]
    moved = [
        replace(b, columns=find(b.columns, at), rows=rows[b.rows])
        for b, at in zip(blocks, used, strict=True)
    ]
    moved.append(_links(np.stack([copies, before], axis=1), link_rows, program.constants))
    made = Program(tuple(moved), variables.size, int(paths.sum() + copies.size), program.constants)
    return Stages(made, variables, linked, rows, states, controls, paths)


def _homes(layouts: Sequence[PhaseLayout], variables: int) -> Integers:
    """The stage that each unknown belongs to, -1 where it belongs to no interval."""
    homes, passed = np.full(variables, -1), 0
    for layout in layouts:
        starts = np.append(layout.nodes[:, 0], layout.nodes[-1, -1] + len(layout.integrals) + 1)
        inner = np.repeat(np.arange(layout.intervals + 1), np.diff(starts))
        homes[starts[0] : starts[-1]] = passed + np.minimum(inner, layout.intervals - 1)
        passed += layout.intervals
    return homes


def _stages_of(blocks: Sequence[Block], homes: Integers, last: int) -> list[Integers]:
    """The stage of each instance: its earliest interval; of the last block, the end."""
    nowhere = last + 1
    known = np.where(homes < 0, nowhere, homes)
    stages = [known[b.columns].min(axis=1, initial=nowhere) for b in blocks[:-1]]
    earliest = np.full(homes.size, nowhere)
    for block, at in zip(blocks, stages, strict=False):
        np.minimum.at(earliest, block.columns, np.broadcast_to(at[:, None], block.columns.shape))
    earliest[earliest == nowhere] = 0
    for i, (block, at) in enumerate(zip(blocks, stages, strict=False)):
        # neither interval nor state: where the last of its unknowns turns up
        stages[i] = np.where(at == nowhere, earliest[block.columns].max(axis=1, initial=0), at)
    return [*stages, np.full(blocks[-1].count, last)]


def _spans(
    columns: Sequence[Integers], used: Sequence[Integers], variables: int
) -> tuple[Integers, Integers]:
    """First and last stage that uses each unknown; 0 where none does."""
    begin, end = np.full(variables, np.iinfo(np.int64).max), np.zeros(variables, dtype=np.int64)
    for ids, at in zip(columns, used, strict=True):
        np.minimum.at(begin, ids, at)
        np.maximum.at(end, ids, at)
    return np.minimum(begin, end), end


def _ranks(groups: Integers) -> Integers:
    """The number of each entry among those of its group, in order."""
    order = np.argsort(groups, kind="stable")
    counts = np.bincount(groups)
    ranks = np.empty(groups.size, dtype=np.int64)
    ranks[order] = np.arange(groups.size) - np.repeat(np.cumsum(counts) - counts, counts)
    return ranks


def _links(pairs: Integers, rows: Integers, constants: int) -> Block:
    """The equations between copies."""
    w, d, c = ca.SX.sym("w", 2), ca.SX(0, 1), ca.SX.sym("c", constants)
    none = ca.SX(0, 1)
    kernel = Kernel(
        ca.Function("outer", [w, none, d, c], [ca.SX.zeros(1), w[0] - w[1]]),
        ca.Function("inner", [w, d], [none]),
    )
    return Block("links", kernel, pairs, np.empty((len(pairs), 0)), rows[:, None], _no_name)


def _no_name(instance: int, row: int) -> RowName:
    return RowName("copies of an unknown")
