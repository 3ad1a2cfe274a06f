"""Nonlinear programs assembled from repeated small kernels.

A block is one small SX function applied to many index sets of the decision vector ("instances").
Its first and second derivatives are taken once, on the kernel, mapped over the instances and
scattered into the sparse Jacobian and Hessian.  Set-up therefore costs the same for one interval
as for a thousand, but for the index lists.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.numerics.columnwise import columnwise


@dataclass(frozen=True, eq=False, repr=False)
class Kernel:
    """An SX function ``(w, d, c) -> (f, g)``.

    Local variables (n_w,), data of the instance (n_d,) and constants of the problem to a
    contribution to the objective (1,) and rows (m,).
    """

    function: ca.Function

    @cached_property
    def costs(self) -> bool:
        """Whether it adds to the objective."""
        return not self.function(*self.symbols())[0].is_zero()

    def symbols(self) -> list[ca.SX]:
        """Symbols of ``w``, ``d`` and ``c``."""
        return [ca.SX.sym(s, self.function.sparsity_in(i)) for i, s in enumerate("wdc")]


@dataclass(frozen=True, eq=False, repr=False)
class Block:
    """One kernel and the places it is applied to.

    Attributes
    ----------
    kernel : see `Kernel`.
    columns : (n, n_w) decision variables of each instance.
    data : (n, n_d) numbers of each instance.
    rows : (n, m) rows of the constraint vector that each instance adds to.
    """

    name: str
    kernel: Kernel
    columns: Integers
    data: Array
    rows: Integers

    @property
    def count(self) -> int:
        """Number of instances."""
        return len(self.columns)

    @property
    def derivatives(self) -> KernelDerivatives:
        """Gradient, Jacobian and Hessian of the kernel."""
        return differentiate(self.kernel)


@dataclass(frozen=True, eq=False, repr=False)
class KernelDerivatives:
    """Parts of a kernel, and the non-zeros of their derivatives with their places.

    The objective and the rows are functions of their own, because the solver asks for one at a
    time.
    """

    objective: ca.Function
    rows: ca.Function
    gradient: ca.Function
    gradient_at: Integers
    jacobian: ca.Function
    jacobian_at: tuple[Integers, Integers]
    hessian: ca.Function
    hessian_at: tuple[Integers, Integers]


@lru_cache(maxsize=512)
def differentiate(kernel: Kernel) -> KernelDerivatives:
    """Derivatives of a kernel with respect to its local variables."""
    inputs = kernel.symbols()
    w = inputs[0]
    f, g = kernel.function(*inputs)
    sigma, lam = ca.SX.sym("sigma"), ca.SX.sym("lam", g.shape[0])
    gradient, jacobian = ca.jacobian(f, w), ca.jacobian(g, w)
    hessian = ca.triu(ca.hessian(sigma * f + ca.dot(lam, g), w)[0])
    return KernelDerivatives(
        objective=ca.Function("objective", inputs, [f]),
        rows=ca.Function("rows", inputs, [g]),
        gradient=_function("gradient", inputs, gradient),
        gradient_at=nonzero_places(gradient.sparsity())[1],
        jacobian=_function("jacobian", inputs, jacobian),
        jacobian_at=nonzero_places(jacobian.sparsity()),
        hessian=_function("hessian", [*inputs, sigma, lam], hessian),
        hessian_at=nonzero_places(hessian.sparsity()),
    )


def _function(name: str, inputs: list[Any], matrix: ca.SX) -> ca.Function:
    """The non-zeros of a matrix."""
    return ca.Function(name, inputs, [matrix.nz[:] if matrix.nnz() else ca.SX(0, 1)])


def nonzero_places(pattern: ca.Sparsity) -> tuple[Integers, Integers]:
    """Rows and columns of the non-zeros of a pattern, in their order."""
    rows, columns = pattern.get_triplet()
    return np.array(rows, dtype=np.int64), np.array(columns, dtype=np.int64)


@dataclass(frozen=True, eq=False, repr=False)
class Program:
    """A nonlinear program, the sum of its blocks, as CasADi's solvers take it.

    Its functions of ``(x, p)`` are built on first use. CasADi's solvers want a place for the value
    beside a derivative, and never read it there: it costs nothing, and is no number.

    Attributes
    ----------
    variables, rows, constants : sizes of x, of the constraint vector and of p.
    """

    blocks: tuple[Block, ...]
    variables: int
    rows: int
    constants: int

    @cached_property
    def most_uses(self) -> int:
        """How often the unknown that is used most is used."""
        uses = np.zeros(self.variables, dtype=np.int64)
        for block in self.blocks:
            uses += np.bincount(block.columns.ravel(), minlength=self.variables)
        return int(uses.max(initial=0))

    @cached_property
    def oracle(self) -> ca.Function:
        """``(x, p) -> (f, g)``."""
        x, p, instances = self._applied
        costly = [i for i in instances if i.block.kernel.costs]
        ruled = [i for i in instances if i.block.rows.shape[1]]
        f = _total([i.mapped(i.parts.objective) for i in costly])
        places = [i.block.rows for i in ruled]
        g = _scatter([i.mapped(i.parts.rows) for i in ruled], places, self.rows)
        return ca.Function("nlp", [x, p], [f, g], ["x", "p"], ["f", "g"])

    @cached_property
    def objective_gradient(self) -> ca.Function:
        """``(x, p) -> (NaN, df/dx)``; the objective is in the `oracle`."""
        x, p, instances = self._applied
        costly = [i for i in instances if i.block.kernel.costs]
        places = [i.block.columns[:, i.parts.gradient_at] for i in costly]
        gradient = _scatter([i.mapped(i.parts.gradient) for i in costly], places, self.variables)
        outputs = [ca.MX.nan(1), gradient]
        return ca.Function("nlp_grad_f", [x, p], outputs, ["x", "p"], ["f", "grad_f_x"])

    @cached_property
    def constraint_jacobian(self) -> ca.Function:
        """``(x, p) -> (NaN, dg/dx)``; the rows are in the `oracle`."""
        x, p, instances = self._applied
        ruled = [i for i in instances if i.block.rows.shape[1]]
        jacobian = _sparse(
            [i.mapped(i.parts.jacobian) for i in ruled],
            [i.block.rows[:, i.parts.jacobian_at[0]] for i in ruled],
            [i.block.columns[:, i.parts.jacobian_at[1]] for i in ruled],
            (self.rows, self.variables),
        )
        outputs = [ca.MX.nan(self.rows), jacobian]
        return ca.Function("nlp_jac_g", [x, p], outputs, ["x", "p"], ["g", "jac_g_x"])

    @cached_property
    def lagrangian_hessian(self) -> ca.Function:
        """``(x, p, lam_f, lam_g) ->`` upper triangle of the Hessian of ``lam_f f + lam_g^T g``."""
        x, p, instances = self._applied
        sigma, lam = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.rows)
        curved = [i for i in instances if i.parts.hessian_at[0].size]
        blocks = [i.block for i in curved]
        hessian = _sparse(
            [i.mapped(i.parts.hessian, sigma, _gather(lam, i.block.rows)) for i in curved],
            *_upper_places(blocks),
            shape=(self.variables, self.variables),
            weights=_diagonal_weights(blocks),
        )
        names = ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]
        return ca.Function("nlp_hess_l", [x, p, sigma, lam], [hessian], *names)

    def prepare(self) -> None:
        """Build the functions now. With thousands of intervals that takes seconds."""
        _ = self.oracle, self.objective_gradient, self.constraint_jacobian, self.lagrangian_hessian

    @cached_property
    def _applied(self) -> tuple[Any, Any, list[_Instances]]:
        """Symbols of x and p, and the blocks applied to them."""
        x, p = ca.MX.sym("x", self.variables), ca.MX.sym("p", self.constants)
        instances = [_Instances(b, _gather(x, b.columns), ca.DM(b.data.T), p) for b in self.blocks]
        return x, p, instances


@dataclass(frozen=True, eq=False, repr=False)
class _Instances:
    """A block applied to the symbols of a program."""

    block: Block
    local: Any
    data: ca.DM
    constants: Any

    @property
    def parts(self) -> KernelDerivatives:
        """Parts and derivatives of the kernel."""
        return self.block.derivatives

    def mapped(self, function: ca.Function, *more: Any) -> Any:
        """A function of the kernel's arguments (and `more`) for all instances side by side."""
        return function.map(self.block.count)(self.local, self.data, self.constants, *more)


def evaluated(
    blocks: Sequence[Block], x: Array, constants: Array, rows: int
) -> tuple[float, Array]:
    """Objective and rows (rows,) of some blocks, from their kernels alone."""
    objective, values = 0.0, np.zeros(rows)
    for block in blocks:
        f, g = columnwise(block.kernel.function, x[block.columns], block.data, constants)
        objective += float(f.sum())
        if block.rows.size:
            np.add.at(values, block.rows, g)
    return objective, values


def _gather(vector: Any, places: Integers) -> Any:
    if places.size == 0:
        return ca.MX(places.shape[1], places.shape[0])
    return ca.reshape(vector[places.ravel().tolist()], places.shape[1], places.shape[0])


def _total(parts: list[Any]) -> Any:
    if not parts:
        return ca.MX(0)
    return ca.sum1(ca.veccat(*[ca.sum2(part) for part in parts]))


def _scatter(parts: list[Any], places: list[Integers], size: int) -> Any:
    """Add the entries of the parts into a dense vector."""
    if not parts:
        return ca.MX.zeros(size)
    flat = np.concatenate([place.ravel() for place in places])
    entries = ca.veccat(*parts)

    # where every place is taken once, a permutation does and no matrix is needed
    if flat.size == size and np.array_equal(np.sort(flat), np.arange(size)):
        return entries[np.argsort(flat).tolist()]
    return ca.densify(ca.mtimes(_selection(flat, size, np.ones(flat.size)), entries))


def _sparse(
    parts: list[Any],
    rows: list[Integers],
    columns: list[Integers],
    shape: tuple[int, int],
    weights: Array | None = None,
) -> Any:
    """Add the entries of the parts into a sparse matrix."""
    if not parts:
        return ca.MX(*shape)
    row = np.concatenate([r.ravel() for r in rows])
    column = np.concatenate([c.ravel() for c in columns])
    if row.size == 0:
        return ca.MX(*shape)

    # the pattern in CasADi's order, column by column
    key, slot = np.unique(column * shape[0] + row, return_inverse=True)
    offsets = np.searchsorted(key // shape[0], np.arange(shape[1] + 1))
    pattern = ca.Sparsity(*shape, offsets.tolist(), (key % shape[0]).tolist())

    entries = ca.veccat(*parts)
    unit = weights is None or bool(np.all(weights == 1.0))
    if unit and key.size == row.size:
        return ca.MX(pattern, entries[np.argsort(slot).tolist()])
    scale = np.ones(row.size) if weights is None else weights
    total = ca.mtimes(_selection(slot.ravel(), key.size, scale), entries)
    return ca.MX(pattern, ca.densify(total))


def _selection(places: Integers, size: int, weights: Array) -> ca.DM:
    """Matrix (size, len(places)) that adds entry j, weighted, to place ``places[j]``."""
    pattern = ca.Sparsity(size, places.size, list(range(places.size + 1)), places.tolist())
    return ca.DM(pattern, weights)


def _upper_places(blocks: Sequence[Block]) -> tuple[list[Integers], list[Integers]]:
    """Rows and columns of the Hessian's entries of each block, in the upper triangle."""
    rows, columns = [], []
    for block in blocks:
        i, j = (block.columns[:, local] for local in block.derivatives.hessian_at)
        rows.append(np.minimum(i, j))
        columns.append(np.maximum(i, j))
    return rows, columns


def _diagonal_weights(blocks: Sequence[Block]) -> Array:
    """2 where two local variables of an instance are the same decision variable, else 1."""
    weights = []
    for block in blocks:
        a, b = block.derivatives.hessian_at
        doubled = (block.columns[:, a] == block.columns[:, b]) & (a != b)[None, :]
        weights.append(np.where(doubled, 2.0, 1.0).ravel())
    return np.concatenate(weights) if weights else np.empty(0)
