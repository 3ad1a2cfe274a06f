"""A CasADi expression as a plain list of instructions, and back.

CasADi's own serialised functions are read by its own machine code.  A list of named operations
can be checked before anything is built from it, survives another version of CasADi, and can be
written out as text.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum, auto
from functools import cache
from typing import TypeAlias

import casadi as ca

# the elementary functions that a scalar expression is made of, in CasADi's names
_OF_ONE = (
    "neg exp log sqrt sq twice sin cos tan asin acos atan not floor ceil fabs sign erf erfinv inv "
    "sinh cosh tanh asinh acosh atanh log1p expm1"
)
_OF_TWO = (
    "add sub mul div pow constpow lt le eq ne and or fmod remainder copysign if_else_zero fmin "
    "fmax atan2 hypot"
)
_OPERANDS = {
    "number": 0,
    "symbol": 1,
    **dict.fromkeys(_OF_ONE.split(), 1),
    **dict.fromkeys(_OF_TWO.split(), 2),
}


# the result of an operation, or what makes it of the operands
Replacement: TypeAlias = "ca.SX | Callable[[list[ca.SX]], ca.SX]"

LONGEST = 160  # characters of an expression that is written and not named by its symbols
_MOST_NAMES = 8  # of symbols that stand for an expression too long to write


@dataclass(frozen=True)
class Instruction:
    """One operation on earlier results.

    Attributes
    ----------
    operation : name of an elementary function, "number", "symbol" or "call".
    operands : positions of earlier instructions; of a symbol its position among the symbols.
    number : the value of a number.
    function, output : the function that is called, such as a table, and which of its outputs it is.
        Numbers of all inputs are the operands, and those of all outputs are counted.
    """

    operation: str
    operands: tuple[int, ...] = ()
    number: float = 0.0
    function: ca.Function | None = None
    output: int = 0

    def called(self, arguments: Sequence[ca.SX]) -> ca.SX:
        """The result of the function that is called."""
        assert self.function is not None
        inputs, rest = [], list(arguments)
        for i in range(self.function.n_in()):
            pattern = self.function.sparsity_in(i)
            own, rest = rest[: pattern.nnz()], rest[pattern.nnz() :]
            inputs.append(ca.SX(pattern, ca.vertcat(*own, ca.SX(0, 1))))
        outputs = self.function.call(inputs)
        return ca.vertcat(*[ca.SX(ca.vertcat(*o.nonzeros())) for o in outputs])[self.output]


@dataclass(frozen=True)
class ExpressionGraph:
    """Scalar expressions of some symbols, shared parts written once.

    Attributes
    ----------
    instructions : in an order in which they can be carried out.
    results : positions of the expressions, in their order.

    Raises
    ------
    ValueError
        When an operation is unknown, or an operand comes after the instruction that needs it.
    """

    instructions: tuple[Instruction, ...]
    results: tuple[int, ...]

    def __post_init__(self) -> None:
        for position, instruction in enumerate(self.instructions):
            name, operands = instruction.operation, instruction.operands
            if name not in _OPERANDS and instruction.function is None:
                raise ValueError(f"instruction {position} is the unknown operation {name!r}")
            if instruction.function is None and len(operands) != _OPERANDS[name]:
                raise ValueError(f"instruction {position} ({name}) has {len(operands)} operands")
            end = math.inf if name == "symbol" else position
            if not all(0 <= i < end for i in operands):
                raise ValueError(f"instruction {position} ({name}) needs a later one")
        if not all(0 <= i < len(self.instructions) for i in self.results):
            raise ValueError("a result is none of the instructions")

    def rebuilt(
        self, symbols: Sequence[ca.SX], instead: Mapping[int, Replacement] | None = None
    ) -> list[ca.SX]:
        """The expressions, of the given symbols.

        Parameters
        ----------
        instead : the results of some instructions, or what makes them of their operands, by
            position.
        """
        codes, values = _codes(), list[ca.SX]()
        for position, instruction in enumerate(self.instructions):
            operands = instruction.operands
            if instead and position in instead:
                new = instead[position]
                values.append(new([values[i] for i in operands]) if callable(new) else new)
            elif instruction.operation == "number":
                values.append(ca.SX(instruction.number))
            elif instruction.operation == "symbol":
                values.append(symbols[operands[0]])
            elif instruction.function is not None:
                values.append(instruction.called([values[i] for i in operands]))
            elif len(operands) == 1:
                values.append(ca.SX.unary(codes[instruction.operation], values[operands[0]]))
            else:
                left, right = (values[i] for i in operands)
                values.append(ca.SX.binary(codes[instruction.operation], left, right))
        return [values[i] for i in self.results]


def graph_of(expressions: Sequence[ca.SX], symbols: Sequence[ca.SX]) -> ExpressionGraph:
    """The instructions of dense scalar expressions.

    Parameters
    ----------
    symbols : all symbols that the expressions depend on; others may be among them.
    """
    stacked = ca.densify(ca.vertcat(*expressions, ca.SX(0, 1)))
    function = ca.Function("expressions", list(symbols), [stacked])
    names = {code: name for name, code in _codes().items()}

    # an instruction of a function does not tell which function it calls
    if any(function.instruction_id(k) == ca.OP_CALL for k in range(function.n_instructions())):
        return _graph_with_calls(expressions, symbols)

    # registers are used again, so every register leads to the instruction that last wrote it
    registers: dict[int, int] = {}
    instructions: list[Instruction] = []
    results = [0] * len(expressions)
    for k in range(function.n_instructions()):
        code, inputs = function.instruction_id(k), function.instruction_input(k)
        output = function.instruction_output(k)
        if code == ca.OP_OUTPUT:
            results[output[1]] = registers[inputs[0]]
            continue
        if code == ca.OP_CONST:
            instruction = Instruction("number", number=float(function.instruction_constant(k)))
        elif code == ca.OP_INPUT:
            instruction = Instruction("symbol", (int(inputs[0]),))
        else:
            instruction = Instruction(names[code], tuple(registers[i] for i in inputs))
        registers[output[0]] = len(instructions)
        instructions.append(instruction)
    return ExpressionGraph(tuple(instructions), tuple(results))


def operations_of(*expressions: ca.SX) -> set[str]:
    """Names of the operations that scalar expressions are made of, found without their graph."""
    stacked = ca.densify(ca.vertcat(*expressions, ca.SX(0, 1)))
    function = ca.Function("expressions", ca.symvar(stacked), [stacked])
    codes = {function.instruction_id(k) for k in range(function.n_instructions())}
    return {name for name, code in _codes().items() if code in codes}


def operands_of(expression: ca.SX) -> list[ca.SX]:
    """What a scalar expression is the result of: operands, or the arguments of a call."""
    made = expression.dep(0) if expression.is_output() else expression
    return [made.dep(i) for i in range(made.n_dep())]


def _graph_with_calls(expressions: Sequence[ca.SX], symbols: Sequence[ca.SX]) -> ExpressionGraph:
    """`graph_of` by the nodes of the expressions, operands before what is made of them."""
    names = {code: name for name, code in _codes().items()}
    places = {symbol.element_hash(): number for number, symbol in enumerate(symbols)}
    instructions = [Instruction("symbol", (number,)) for number in range(len(symbols))]
    stack = [ca.densify(e) for e in reversed(expressions)]
    while stack:
        node, operands = stack[-1], operands_of(stack[-1])
        missing = [operand for operand in operands if operand.element_hash() not in places]
        if node.element_hash() in places or missing:
            stack = stack + missing if node.element_hash() not in places else stack[:-1]
            continue

        of = tuple(places[operand.element_hash()] for operand in operands)
        if node.is_constant():
            instruction = Instruction("number", number=float(node))
        elif node.is_output():
            called = node.dep(0).which_function()
            instruction = Instruction("call", of, function=called, output=node.which_output())
        else:
            instruction = Instruction(names[node.op()], of)
        places[node.element_hash()] = len(instructions)
        instructions.append(instruction)
        stack.pop()
    results = tuple(places[ca.densify(e).element_hash()] for e in expressions)
    return ExpressionGraph(tuple(instructions), results)


def expression_text(
    expression: ca.SX, name_of: Callable[[ca.SX], str] | None = None, longest: int = LONGEST
) -> str:
    """A scalar expression as one writes it, such as ``a*sin(q)^2 - 1``.

    Parameters
    ----------
    name_of : what to write for a symbol; by default its name.
    longest : an expression of more characters is named by the symbols it depends on.
    """
    name_of = name_of or ca.SX.name
    symbols = ca.symvar(expression)
    graph = graph_of([expression], symbols)
    names = [name_of(symbol) for symbol in symbols]

    # shared parts are written out wherever they appear, so a long part is dropped early
    parts: list[_Text | None] = []
    for instruction in graph.instructions:
        if instruction.operation == "number":
            parts.append(_number_text(instruction.number))
        elif instruction.operation == "symbol":
            parts.append(_Text(names[instruction.operands[0]]))
        else:
            operands = [part for i in instruction.operands if (part := parts[i]) is not None]
            whole = len(operands) == len(instruction.operands)
            name = instruction.function.name() if instruction.function else instruction.operation
            text = _operation_text(name, operands) if whole else None
            parts.append(text if text and len(text.text) <= longest else None)
    result = parts[graph.results[0]]
    if result:
        return result.text
    named = names if len(names) <= _MOST_NAMES else [*names[:_MOST_NAMES], "..."]
    return f"f({', '.join(named)})"


class _Binding(IntEnum):
    """How tightly an operation binds its operands, the loosest one first."""

    OR = auto()
    AND = auto()
    COMPARISON = auto()
    SUM = auto()
    NEGATIVE = auto()  # less than a product, so that a power or a divisor puts it in parentheses
    PRODUCT = auto()
    DIVISOR = auto()
    POWER = auto()
    WHOLE = auto()


@dataclass(frozen=True, repr=False)
class _Text:
    """A part of an expression and how tightly its last operation binds."""

    text: str
    binding: int = _Binding.WHOLE

    def within(self, binding: int) -> str:
        """The text as an operand of an operation that binds this tightly."""
        return self.text if self.binding >= binding else f"({self.text})"


# operation: sign between its operands, how tightly it binds, what its right operand needs
_INFIX = {
    "or": (" or ", _Binding.OR, _Binding.OR),
    "and": (" and ", _Binding.AND, _Binding.AND),
    "lt": (" < ", _Binding.COMPARISON, _Binding.SUM),
    "le": (" <= ", _Binding.COMPARISON, _Binding.SUM),
    "eq": (" == ", _Binding.COMPARISON, _Binding.SUM),
    "ne": (" != ", _Binding.COMPARISON, _Binding.SUM),
    "add": (" + ", _Binding.SUM, _Binding.SUM),
    "sub": (" - ", _Binding.SUM, _Binding.PRODUCT),
    "mul": ("*", _Binding.PRODUCT, _Binding.PRODUCT),
    "div": ("/", _Binding.PRODUCT, _Binding.DIVISOR),
    "pow": ("^", _Binding.POWER, _Binding.POWER),
    "constpow": ("^", _Binding.POWER, _Binding.POWER),
}
_FUNCTIONS = {"if_else_zero": "if", "fmin": "min", "fmax": "max", "fabs": "abs"}


def _operation_text(name: str, operands: Sequence[_Text]) -> _Text:
    first = operands[0]
    if name in _INFIX:
        return _infix_text(name, first, operands[1])
    if name == "neg":
        return _Text(f"-{first.within(_Binding.PRODUCT)}", _Binding.NEGATIVE)
    if name == "sq":
        return _Text(f"{first.within(_Binding.WHOLE)}^2", _Binding.POWER)
    if name == "twice":
        return _Text(f"2*{first.within(_Binding.PRODUCT)}", _Binding.PRODUCT)
    if name == "inv":
        return _Text(f"1/{first.within(_Binding.DIVISOR)}", _Binding.PRODUCT)
    arguments = ", ".join(operand.text for operand in operands)
    return _Text(f"{_FUNCTIONS.get(name, name)}({arguments})")


def _infix_text(name: str, first: _Text, second: _Text) -> _Text:
    sign, binding, right = _INFIX[name]
    if name == "add" and second.text.startswith("-"):
        return _Text(f"{first.text} - {second.text[1:]}", binding)
    if name in ("mul", "div") and first.binding == _Binding.NEGATIVE:
        return _Text(f"{first.text}{sign}{second.within(right)}", _Binding.NEGATIVE)
    left = first.within(binding + (sign == "^"))  # a power of a power needs parentheses
    return _Text(f"{left}{sign}{second.within(right)}", binding)


def _number_text(value: float) -> _Text:
    return _Text(f"{value:.6g}", _Binding.NEGATIVE if value < 0 else _Binding.WHOLE)


@cache
def _codes() -> dict[str, int]:
    """CasADi's number of each operation."""
    names = (*_OF_ONE.split(), *_OF_TWO.split())
    return {name: getattr(ca, f"OP_{name.upper()}") for name in names}
