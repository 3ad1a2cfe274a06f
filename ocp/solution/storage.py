"""Solutions in files: pickled with their statement, without live CasADi symbols.

CasADi expressions cannot be pickled, but its functions can be written out.  Every expression is
stored as a serialised function of the bare symbols it depends on, and every bare symbol once, by
name; loading declares the symbols anew and calls the functions on them.  What can be derived
again is left out: compiled functions, the nonlinear program, guesses (which may be any callable).
As with every pickle: load only files you trust.
"""

from __future__ import annotations

import copyreg
import io
import pickle
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import casadi as ca

from ocp.mesh.evaluation import Evaluator
from ocp.problem.statement import Phase
from ocp.problem.symbols import _DECLARED, Symbol, Time, time

if TYPE_CHECKING:
    from ocp.solution.solution import Solution

_HEADER = b"ocp solution 1\n"


def save(solution: Solution, path: str | Path) -> None:
    """Write a solution to one file."""
    Path(path).write_bytes(_HEADER + zlib.compress(pickle.dumps(solution)))


def load(path: str | Path) -> Solution:
    """Read a solution that `save` wrote.

    Raises
    ------
    ValueError
        When the file is no such file.
    """
    data = Path(path).read_bytes()
    if not data.startswith(_HEADER):
        raise ValueError(f"'{path}' holds no solution; give a file that ocp.save wrote")
    found: Solution = pickle.loads(zlib.decompress(data[len(_HEADER) :]))
    return found


def packed(fields: Mapping[str, Any]) -> bytes:
    """The fields of a solution as bytes."""
    stream = io.BytesIO()
    _Pickler(stream, protocol=pickle.HIGHEST_PROTOCOL).dump(dict(fields))
    return stream.getvalue()


def unpacked(kind: Callable[..., Any], data: bytes) -> Any:
    """The object of that kind from its fields."""
    return kind(**pickle.loads(data))


class _Pickler(pickle.Pickler):
    """Knows how to write expressions, symbols and what holds them."""

    def __init__(self, file: io.BytesIO, protocol: int) -> None:
        super().__init__(file, protocol)
        self._bare: dict[int, ca.SX] = {}

    def reducer_override(self, value: Any) -> Any:
        """How to write an object; NotImplemented for the usual way."""
        if isinstance(value, ca.SX):
            return self._expression(value)
        if isinstance(value, Time):
            return _the_time, ()
        if isinstance(value, Symbol):
            return _blank, (type(value),), dict(value.__dict__), None, None, _declare
        if isinstance(value, Phase):
            state = {**value.__dict__, "guess": {}}
            return copyreg.__newobj__, (Phase,), state  # type: ignore[attr-defined]
        if isinstance(value, Evaluator):
            return Evaluator, (value.problem,)
        return NotImplemented

    def _expression(self, value: ca.SX) -> Any:
        if value.is_scalar() and value.is_symbolic():
            if value.element_hash() == time.symbol.element_hash():
                return _time_symbol, ()
            kept = self._bare.setdefault(value.element_hash(), value)
            return (_symbol, (value.name(),)) if kept is value else (_same, (kept,))
        bare = [self._bare.setdefault(s.element_hash(), s) for s in ca.symvar(value)]
        return _applied, (ca.Function("expression", bare, [value]).serialize(), *bare)


def _applied(function: str, *bare: ca.SX) -> ca.SX:
    found: ca.SX = ca.Function.deserialize(function).call(list(bare))[0]
    return found


def _symbol(name: str) -> ca.SX:
    return ca.SX.sym(name)


def _same(bare: ca.SX) -> ca.SX:
    return bare


def _the_time() -> Time:
    return time


def _time_symbol() -> ca.SX:
    return time.symbol


def _blank(kind: type[Symbol]) -> Symbol:
    return kind.__new__(kind)


def _declare(symbol: Symbol, state: Mapping[str, Any]) -> None:
    """Fill a symbol, and make its bare CasADi symbol lead to it."""
    symbol.__dict__.update(state)
    _DECLARED[symbol.symbol.element_hash()] = symbol
