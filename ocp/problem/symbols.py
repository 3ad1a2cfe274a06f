"""Named symbols of a problem statement: signals, unknowns, constants.

Every symbol can stand wherever CasADi takes an ``SX`` expression.  CasADi expressions keep only
bare symbols; a weak table leads from a bare symbol back to the object that declared it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, Literal, Self, TypeVar
from weakref import WeakValueDictionary

import casadi as ca

from ocp.errors import StatementError
from ocp.keywords import as_written, checked_keywords
from ocp.problem.vectors import vector_of

Number = Real
Piecewise = Literal["constant", "linear", "polynomial", "automatic", "full"]
Declared = TypeVar("Declared", bound=type)

# words of other tools, and what to write here
LIMIT_WORDS = {
    **dict.fromkeys(("min", "lb", "minimum", "low"), "write lower={value}"),
    **dict.fromkeys(("max", "ub", "maximum", "high"), "write upper={value}"),
    "bounds": "write lower=..., upper=...",
    "limits": "write lower=..., upper=...",
}
_OF_A_SIGNAL = {
    **LIMIT_WORDS,
    "guess": "write it in the phase: Phase(guess={{signal: {value}}})",
}
_OF_A_STATE = {
    **_OF_A_SIGNAL,
    "initial": "write it in the phase: Phase(initial={{state: {value}}})",
    "final": "write it in the phase: Phase(final={{state: {value}}})",
}
_OF_AN_UNKNOWN = {
    **LIMIT_WORDS,
    **dict.fromkeys(("initial", "value", "start"), "write guess={value}"),
}
_OF_A_CONSTANT = dict.fromkeys(("val", "default", "guess"), "write value={value}")

_DECLARED: WeakValueDictionary[int, Symbol] = WeakValueDictionary()


class Relation(ca.SX):
    """A comparison of a symbol, such as ``x <= 2``, for the bounds of a phase or problem."""

    def __bool__(self) -> bool:
        raise self._undecided("if")

    def __array_function__(self, function: Any, *_: Any) -> Any:
        # CasADi's own dispatch knows SX itself only, and calls itself without end
        raise self._undecided(f"np.{function.__name__}")

    def _undecided(self, used: str) -> StatementError:
        return StatementError(
            f"the relation '{str(self).strip('()')}' is neither true nor false before the problem "
            "is solved; give bounds one by one ([-1 <= x, x <= 1] instead of -1 <= x <= 1), and "
            f"write ca.if_else(x <= 1, this, that) instead of {used}"
        )


class Symbol(ca.GenericExpressionCommon):
    """Something with a name and a unit that takes part in expressions."""

    name: str
    unit: str
    symbol: ca.SX

    @property
    def text(self) -> str:
        """What one writes for it."""
        return self.name

    @property
    def value_of(self) -> ca.SX | None:
        """The expression that it is a value of, in the same unit; None for most."""
        return None

    def __SX__(self) -> ca.SX:
        return self.symbol

    def __neg__(self) -> ca.SX:
        return -self.symbol

    def __pos__(self) -> Self:
        return self

    def __float__(self) -> float:
        raise StatementError(
            f"'{self.name}' is a symbol, not a number; write ca.sin(x) instead of math.sin(x), and "
            "after the solve solution.sample(x, times) or solution.value(x)"
        )

    def __lt__(self, other: Any) -> Any:
        return _relation(super().__lt__(other))

    def __le__(self, other: Any) -> Any:
        return _relation(super().__le__(other))

    def __gt__(self, other: Any) -> Any:
        return _relation(super().__gt__(other))

    def __ge__(self, other: Any) -> Any:
        return _relation(super().__ge__(other))

    def __eq__(self, other: object) -> Any:
        return _relation(super().__eq__(other))

    def __ne__(self, other: object) -> Any:
        return _relation(super().__ne__(other))

    __hash__ = object.__hash__

    def _declare(self) -> None:
        if not self.name or not isinstance(self.name, str):
            raise StatementError(
                f"a symbol needs a name, got {self.name!r}; write the name first: State('speed')"
            )
        check_unit(self.name, self.unit)
        object.__setattr__(self, "unit", self.unit.strip() or "1")
        object.__setattr__(self, "symbol", ca.SX.sym(self.name))
        _DECLARED[self.symbol.element_hash()] = self

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self


def may_be_vector(kind: Declared) -> Declared:
    """Let a class of symbols make a `Vector` if it is given a shape.

    The class docstring says so under *shape*.
    """
    scalar_new: Any = kind.__new__

    def new(cls: Any, *arguments: Any, shape: Any = None, **given: Any) -> Any:
        if shape is None:
            return scalar_new(cls, *arguments, **given)
        if isinstance(shape, str):
            raise StatementError(
                f"the shape of a {cls.__name__} is the number of its components, not {shape!r}; "
                f"how a control varies within an interval is piecewise={shape!r}"
            )
        # what is no instance of the class is returned as it is, without its constructor
        return vector_of(cls, shape, *arguments, **given)

    setattr(kind, "__new__", new)  # noqa: B010
    return kind


def _relation(comparison: Any) -> Any:
    """What CasADi made of a comparison, with a truth value that explains itself."""
    symbolic = isinstance(comparison, ca.SX) and not comparison.is_constant()
    return Relation(comparison) if symbolic else comparison


def check_name(kind: str, name: Any) -> None:
    """StatementError unless a name is a text."""
    if not (isinstance(name, str) and name):
        raise StatementError(f"the name of a {kind} is {name!r}; give a text as its first argument")


def check_unit(name: str, unit: Any) -> None:
    """StatementError unless a unit is a text."""
    if not isinstance(unit, str):
        raise StatementError(
            f"the unit of '{name}' is {unit!r}; give a text such as 'm/s', or '1', and limits as "
            "lower=..., upper=..."
        )


@dataclass(frozen=True, eq=False, repr=False)
class Signal(Symbol):
    """A function of time.

    Attributes
    ----------
    name, unit : str
        Name and SI unit, used in every message, table and plot.
    lower, upper : number, Constant or expression of constants and unknowns
        Bounds that hold at all times of a phase.
    scale : float or None
        Typical size; derived from bounds, guess and dynamics if None.
    is_limited : bool
        Whether it has a bound.
    coupled : tuple of (str, SX)
        Sides whose limit depends on an unknown, with that limit. Every phase with the signal bounds
        their difference; the side itself counts as unlimited.
    """

    name: str
    unit: str = "1"
    lower: Any = -math.inf
    upper: Any = math.inf
    scale: float | None = None
    symbol: ca.SX = field(init=False, repr=False)
    is_limited: bool = field(init=False, repr=False)
    coupled: tuple[tuple[str, ca.SX], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._declare()
        check_interval(self.name, self.lower, self.upper)
        check_scale(self.name, self.scale)
        coupled = []
        for side, free in (("lower", -math.inf), ("upper", math.inf)):
            limit = getattr(self, side)
            if not is_plain(limit):
                coupled.append((side, scalar(limit, f"a bound of '{self.name}'")))
                object.__setattr__(self, side, free)
        object.__setattr__(self, "coupled", tuple(coupled))
        object.__setattr__(self, "is_limited", is_limited(self.lower, self.upper))

    def __repr__(self) -> str:
        return as_written(self)


@may_be_vector
@checked_keywords(_OF_A_STATE)
class State(Signal):
    """A signal whose time derivative the dynamics of a phase give.

    Parameters
    ----------
    name, unit : str
        Name and SI unit, used in every message, table and plot.
    lower, upper : number, Constant or expression of constants and unknowns
        Bounds that hold at all times of a phase [unit].
    scale : float or None
        Typical size [unit]. It is derived from guess, bounds or dynamics if None.
    shape : int, optional
        Number of components of a vector. Limits, scale and guess are then one for all components or
        a list, and ``q[i]`` is the component ``"q[i]"``.

    Raises
    ------
    StatementError
        When the name is missing, the limits cross, or the scale is not positive.
    """


@may_be_vector
@checked_keywords(_OF_A_SIGNAL)
class Algebraic(Signal):
    """A signal without a derivative, determined by the equations of a phase.

    An equation is a bound whose lower and upper limit are the same.

    Parameters
    ----------
    name, unit : str
        Name and SI unit, used in every message, table and plot.
    lower, upper : number, Constant or expression of constants and unknowns
        Bounds that hold at all times of a phase [unit].
    scale : float or None
        Typical size [unit]. It is derived from guess, bounds or dynamics if None.
    shape : int, optional
        Number of components of a vector. Limits, scale and guess are then one for all components or
        a list, and ``q[i]`` is the component ``"q[i]"``.

    Raises
    ------
    StatementError
        When the name is missing, the limits cross, or the scale is not positive.
    """


@may_be_vector
@checked_keywords(_OF_A_SIGNAL)
@dataclass(frozen=True, eq=False, repr=False)
class Control(Signal):
    """A signal that the optimiser chooses.

    It may jump between mesh intervals, and it keeps its bounds at all times by construction.

    Parameters
    ----------
    name, unit : str
        Name and SI unit, used in every message, table and plot.
    lower, upper : number, Constant or expression of constants and unknowns
        Bounds that hold at all times of a phase [unit].
    scale : float or None
        Typical size [unit]. It is derived from guess, bounds or dynamics if None.
    shape : int, optional
        Number of components of a vector. Limits, scale and guess are then one for all components or
        a list, and ``q[i]`` is the component ``"q[i]"``.
    piecewise : str or None
        How it may vary within a mesh interval: "constant", "linear", "polynomial" (of the scheme's
        degree), "automatic" or "full" (see `ocp.problem.integrator_chains.variation_of`). If None,
        as the settings say.

    Raises
    ------
    StatementError
        When the name is missing, the limits cross, or the scale is not positive.
    """

    piecewise: Piecewise | None = None


@may_be_vector
@checked_keywords(_OF_AN_UNKNOWN)
@dataclass(frozen=True, eq=False, repr=False)
class Unknown(Symbol):
    """A number that the optimiser chooses: a static decision parameter.

    Parameters
    ----------
    name, unit : str
        Name and SI unit, used in every message, table and plot.
    lower, upper : number, Constant or expression of constants
        Between which it is sought [unit].
    guess : float or None
        Where the solver starts [unit]. It is taken from the limits if None.
    scale : float or None
        Typical size [unit]. It is derived from guess or limits if None.
    shape : int, optional
        Number of components of a vector. Limits, scale and guess are then one for all components or
        a list, and ``q[i]`` is the component ``"q[i]"``.

    Raises
    ------
    StatementError
        When the name is missing, the limits cross, or the scale is not positive.
    """

    name: str
    unit: str = "1"
    lower: Any = -math.inf
    upper: Any = math.inf
    guess: float | None = None
    scale: float | None = None
    symbol: ca.SX = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._declare()
        check_interval(self.name, self.lower, self.upper)
        check_scale(self.name, self.scale)
        if self.guess is not None and not (is_real(self.guess) and math.isfinite(self.guess)):
            raise StatementError(
                f"the guess of '{self.name}' is {self.guess!r}; give a finite number"
            )

    def __repr__(self) -> str:
        return as_written(self)


@checked_keywords(_OF_A_CONSTANT)
@dataclass(frozen=True, eq=False)
class Constant(Symbol):
    """A named number of the problem; it may be changed between solves and has a sensitivity.

    Parameters
    ----------
    name, unit : str
        Name and SI unit, used in every message, table and plot.
    value : float
        Its value unless a solve is given another one [unit].

    Raises
    ------
    StatementError
        When the name is missing, or the value is no finite number.
    """

    name: str
    unit: str = "1"
    value: float = math.nan
    symbol: ca.SX = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._declare()
        if not (is_real(self.value) and math.isfinite(self.value)):
            raise StatementError(
                f"the constant '{self.name}' is {self.value!r}; give it a finite number"
            )


@checked_keywords({**LIMIT_WORDS, "initial": "write guess={value}"})
@dataclass(frozen=True)
class Between:
    """A time that the optimiser chooses between two limits.

    Parameters
    ----------
    lower, upper : float
        The limits [s].
    guess : float or None
        Where the solver starts [s]. It is the middle of the limits if None, or evenly between the
        other times where phases meet and the middles are not in order.

    Raises
    ------
    StatementError
        When the limits are no numbers or cross, or the guess lies outside.
    """

    lower: float
    upper: float
    guess: float | None = None

    def __post_init__(self) -> None:
        for limit in (self.lower, self.upper):
            if not is_real(limit):
                raise StatementError(
                    f"a limit of a free time is {limit!r}; give a number of seconds, or write a "
                    "limit that depends on an unknown or a constant as a bound of the problem, "
                    "such as Bound('end', phase.end_time - limit, 's', upper=0)"
                )
        check_interval("a free time", self.lower, self.upper)
        if self.guess is None:
            return
        if not is_real(self.guess) or not self.lower <= self.guess <= self.upper:
            raise StatementError(
                f"the guess {self.guess!r} of a free time lies outside [{self.lower}, "
                f"{self.upper}]; give a guess between the limits"
            )

    @property
    def start(self) -> float:
        """The guess, or the middle of the limits; StatementError if one of these is infinite."""
        if self.guess is not None:
            return float(self.guess)
        if math.isinf(self.lower) or math.isinf(self.upper):
            raise StatementError(f"a free time between {self.lower} and {self.upper} needs a guess")
        return 0.5 * (self.lower + self.upper)


@dataclass(frozen=True, eq=False)
class ByFraction:
    """A guess along a phase by the fraction of it that has passed, from 0 to 1.

    For phases whose times are free, or when the same guess serves several.

    Parameters
    ----------
    values : callable or (fractions, values)
        A function of fractions (vectorised), or a table of two arrays of the same length.
    """

    values: Any


@dataclass(frozen=True, eq=False)
class Time(Symbol):
    """The running time of a phase [s]."""

    name: str = "time"
    unit: str = "s"
    symbol: ca.SX = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._declare()


TIME = Time()


def resolve(expression: Any, where: str) -> tuple[Symbol, ...]:
    """The declared symbols an expression depends on, in CasADi's order.

    Raises
    ------
    StatementError
        If the expression is no scalar or contains a symbol that nothing declared.
    """
    if is_real(expression):
        return ()
    symbols = []
    for bare in ca.symvar(scalar(expression, where)):
        symbol = _DECLARED.get(bare.element_hash())
        if symbol is None:
            raise StatementError(
                f"{where} contains the symbol '{bare.name()}', which no State, Control, Algebraic, "
                "Unknown or Constant declares; declare it and keep it in a variable"
            )
        symbols.append(symbol)
    return tuple(symbols)


def symbols_of(expressions: Iterable[Any], where: str) -> tuple[Symbol, ...]:
    """The declared symbols that any of some expressions depends on, in order of appearance."""
    return tuple(dict.fromkeys(s for expression in expressions for s in resolve(expression, where)))


def declared_value(expression: Any) -> float | None:
    """Of an expression of numbers and constants, as these are declared; None of any other."""
    symbols = resolve(expression, "an expression")
    values = [symbol.value for symbol in symbols if isinstance(symbol, Constant)]
    if len(values) < len(symbols):
        return None
    function = ca.Function("value", [s.symbol for s in symbols], [scalar(expression, "it")])
    return float(function.call(values)[0])


def column_of(symbols: Iterable[Symbol]) -> ca.SX:
    """The bare symbols (n,), a column also where there are none."""
    return ca.vertcat(*[symbol.symbol for symbol in symbols], ca.SX(0, 1))


def scalar(expression: Any, where: str) -> ca.SX:
    """The expression as a 1x1 ``SX``; StatementError if it is something else."""
    try:
        sx = expression.__SX__() if isinstance(expression, Symbol) else expression
        sx = sx if isinstance(sx, ca.SX) else ca.SX(sx)
    except (TypeError, NotImplementedError, ValueError):
        # CasADi's own text lists prototypes, which help nobody
        remedy = "give one expression of signals, unknowns, constants and functionals"
        if isinstance(expression, ca.MX):
            remedy = "an MX cannot be combined with the symbols declared here, which are of type SX"
        elif callable(expression):
            remedy = "call it, and give the expression that it returns"
        raise StatementError(
            f"{where} is {expression!r}, not a CasADi SX expression; {remedy}"
        ) from None
    if not sx.is_scalar():
        raise StatementError(
            f"{where} has shape {sx.shape[0]}x{sx.shape[1]}; give one scalar expression for each "
            "entry"
        )
    return sx if sx.is_dense() else ca.densify(sx)


def is_number(value: Any) -> bool:
    """Whether a bound is a plain number and no expression."""
    return not isinstance(value, (Symbol, ca.SX))


def is_plain(limit: Any) -> bool:
    """Whether a limit depends on no unknown."""
    return is_number(limit) or not any(isinstance(s, Unknown) for s in resolve(limit, "a limit"))


def is_real(value: object) -> bool:
    """Whether a value is a real number (NumPy's included)."""
    return isinstance(value, Number)


def is_limited(*limits: Any) -> bool:
    """Whether any of the limits may be finite; expressions of constants count as finite."""
    return not all(is_number(limit) and math.isinf(limit) for limit in limits)


def check_interval(name: str, lower: Any, upper: Any) -> None:
    """StatementError unless lower and upper bound a non-empty interval."""
    for value in (lower, upper):
        if is_number(value) and not (is_real(value) and not math.isnan(value)):
            raise StatementError(
                f"a bound of '{name}' is {value!r}; give a number, or leave it out"
            )
    if is_number(lower) and is_number(upper) and lower > upper:
        raise StatementError(
            f"the bounds of '{name}' contradict each other: lower {lower} is above upper {upper}; "
            "swap or widen them"
        )


def check_scale(name: str, scale: float | None) -> None:
    """StatementError unless the scale is None or a positive finite number."""
    if scale is not None and not (is_real(scale) and math.isfinite(scale) and scale > 0):
        raise StatementError(f"the scale of '{name}' is {scale!r}; give a positive number")
