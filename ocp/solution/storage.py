"""Solutions in files from which nothing can run code.

A file is a zip archive: the arrays as NumPy writes them, without Python objects, and one JSON text.
The text lists objects of a few known classes with their fields.  An object refers to others by
their numbers, and only to those before it.  An expression is a list of elementary functions by name
(`ocp.numerics.expression_graph`), so that reading it builds an expression and does nothing else.

Left out is what can be made again: compiled functions and the nonlinear program.  Guesses that are
functions of time are kept as tables.
"""

from __future__ import annotations

import base64
import io
import json
import math
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.errors import FileError
from ocp.mesh.initial_guess import StatedGuess, guessed_times
from ocp.numerics.expression_graph import ExpressionGraph, Instruction, graph_of
from ocp.problem.interpolants import Interpolant, interpolant_of
from ocp.problem.parameters import parameters_of
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem, without_repeated_warnings
from ocp.problem.symbols import TIME, ByFraction, Signal, Symbol, Time, resolve
from ocp.reformulate.form import Form
from ocp.solution.disk import check_room, read_file, write_file
from ocp.solution.solution import Solution

_FORMAT = "ocp solution"
_VERSION = 8
_TEXT = "solution.json"

_LISTS, _BYTES_OF_A_LIST = 200_000, 2  # packed, of which the text of a solution has one in three
_SAMPLES = 2001  # of a guess that is a function of time

FurtherClass = Callable[[str], Any]
"""From "module:name" to the frozen dataclass there; it raises ValueError where that is none."""


def save(solution: Solution, path: str | Path) -> None:
    """Write a solution with its problem, mesh, multipliers and verification to one file.

    Parameters
    ----------
    solution : Solution
    path : path
        A file that is there is replaced.

    Raises
    ------
    TypeError
        When it is no solution, or holds an object of a class that files do not know.
    FileError
        When the folder is missing, or the file cannot be written.
    """
    if not isinstance(solution, Solution):
        raise TypeError(f"save writes a Solution, not {solution!r}; solve it first")
    write_file(path, packed(solution))


def load(path: str | Path) -> Solution:
    """Read a solution that `save` wrote.  Nothing in the file can run code.

    Parameters
    ----------
    path : path
        Of the file.

    Raises
    ------
    FileError
        When the file is missing, holds no solution, is damaged, or was written by another version.
    """
    solution = unpacked(read_file(path), name=str(path))
    if not isinstance(solution, Solution):
        raise _no_solution(str(path))
    return solution


def packed(thing: Any, known: Problem | None = None, further: FurtherClass | None = None) -> bytes:
    """A solution, problem or trajectory as bytes, or values, arrays and tables that hold them.

    Parameters
    ----------
    known : Problem, optional
        Left out, because whoever reads the bytes has the same problem.
    further : function, optional
        Finds classes of the caller's own, whose objects `thing` may hold, too.

    Raises
    ------
    TypeError
        When it holds an object of a class that is not known.
    """
    writer = _Writer(further)
    if known is not None:
        writer.written(known)
    entries, arrays = len(writer.entries), len(writer.arrays)
    root = writer.written(thing)
    text = {
        "format": _FORMAT,
        "version": _VERSION,
        "objects": writer.entries[entries:],
        "root": root,
    }

    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(_TEXT, json.dumps(text, allow_nan=False))
        for number, array in enumerate(writer.arrays[arrays:], start=arrays):
            with archive.open(f"{number}.npy", "w") as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
    return stream.getvalue()


def tabulated(problem: Problem) -> Problem:
    """The same problem with tables for guesses that are functions of time, as a file keeps it.

    A solve of it takes the same steps here and in another process, or after the problem was stored.
    """
    phases = [replace(phase, guess=_tabulated(phase, problem)) for phase in problem.phases]
    with without_repeated_warnings():
        return replace(problem, phases=phases)


def unpacked(
    data: bytes,
    known: Problem | None = None,
    name: str = "the data",
    further: FurtherClass | None = None,
) -> Any:
    """What `packed` wrote.

    Parameters
    ----------
    known : Problem, optional
        The problem that was left out.  What is read refers to its symbols.
    name : str
        Of the file, for messages.
    further : function, optional
        As it was given to `packed`.

    Raises
    ------
    FileError
        When it is no such data, damaged, or of another version.
    """
    # what is wrong inside a file shows in many ways, all of them while its objects are built
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            check_room(archive.infolist(), len(data))
            text = _parsed(archive.read(_TEXT), len(data))
            if text["format"] != _FORMAT:
                raise ValueError(f"its format is {text['format']!r}")
            if text["version"] != _VERSION:
                raise FileError(
                    f"'{name}' is a solution in file version {text['version']!r}, but this version "
                    f"of ocp reads {_VERSION}; solve again and save it, or load it with the ocp "
                    "that wrote it"
                )
            return _read(archive, text, known, further)
    except FileError:
        raise
    except Exception as error:
        # the name of the first member is at the beginning, the list of all of them at the end
        if _TEXT.encode() not in data[:100]:
            raise _no_solution(name) from error
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise FileError(
            f"'{name}' is a damaged solution ({reason}); solve again and save it"
        ) from error


def _parsed(text: bytes, packed_size: int) -> Any:
    """The JSON text of an archive; a bracket takes up to 60 times its room in memory."""
    if text.count(b"[") + text.count(b"{") > _LISTS + packed_size / _BYTES_OF_A_LIST:
        raise ValueError("it has too many lists for its size")
    return json.loads(text)


def _no_solution(name: str) -> FileError:
    return FileError(f"'{name}' contains no solution; give a file that ocp.save wrote")


def _read(
    archive: zipfile.ZipFile, text: Any, known: Problem | None, further: FurtherClass | None
) -> Any:
    """The objects of an archive, which follow those of the known problem."""
    writer = _Writer()
    if known is not None:
        writer.written(known)
    reader = _Reader(archive, writer.originals, further)
    for entry in text["objects"]:
        reader.objects.append(reader.made(entry))
    return reader.read(text["root"])


class _Writer:
    """Lists objects, each after those it refers to.

    Attributes
    ----------
    entries : what JSON takes of each object.
    originals : the objects themselves.
    arrays : of the objects that are arrays.
    """

    def __init__(self, further: FurtherClass | None = None) -> None:
        self._further = further
        self.entries: list[Any] = []
        self.originals: list[Any] = []
        self.arrays: list[Array] = []
        self._places: dict[int, int] = {}
        self._problem: Problem | None = None

    def written(self, value: Any) -> Any:
        """What JSON takes of a value: the value itself, or the number of an object."""
        # what only looks like a text or a tuple would come back as one
        if value is None or isinstance(value, bool) or type(value) is str:
            return value
        if isinstance(value, np.bool_):
            return bool(value)
        if isinstance(value, (int, np.integer)):
            return int(value)
        if isinstance(value, (float, np.floating)):
            number = float(value)
            return number if math.isfinite(number) else {"number": repr(number)}
        if type(value) is tuple:
            return [self.written(item) for item in value]
        if isinstance(value, list):
            return {"list": [self.written(item) for item in value]}
        if isinstance(value, Mapping):
            pairs = value.items()
            return {"mapping": [[self.written(key), self.written(item)] for key, item in pairs]}
        if isinstance(value, bytes):
            return {"bytes": base64.b64encode(value).decode("ascii")}
        return {"object": self._place(value)}

    def _place(self, value: Any) -> int:
        """The number of an object, which is listed if it is new."""
        place = self._places.get(id(value))
        if place is None:
            entry = self._entry(value)
            place = self._places[id(value)] = len(self.entries)
            self.entries.append(entry)
            self.originals.append(value)  # alive, so that nothing else gets its id
        return place

    def _entry(self, value: Any) -> Any:
        if isinstance(value, np.ndarray):
            if value.dtype.hasobject:
                raise TypeError("an array of Python objects cannot be saved; give numbers")
            self.arrays.append(value)
            return {"array": len(self.arrays) - 1}
        if isinstance(value, ca.SX):
            return self._expression(value)
        if isinstance(value, Time):
            return {"class": "Time", "fields": {}}
        kind: Any = type(value)
        name = self._name(kind)
        if kind is Problem:
            self._problem = value
        stored = {field: getattr(value, field) for field in _stored_fields(kind)}
        if isinstance(value, Phase):
            stored["guess"] = _tabulated(value, self._problem)
        return {"class": name, "fields": {key: self.written(v) for key, v in stored.items()}}

    def _name(self, kind: Any) -> str:
        """What a class is called in a file."""
        name: str = kind.__name__
        if _classes().get(name) is kind:
            return name
        place = f"{kind.__module__}:{kind.__qualname__}"
        if self._further is None or self._further(place) is not kind:
            raise TypeError(f"an object of the class {name} cannot be saved with a solution")
        return place

    def _expression(self, value: ca.SX) -> Any:
        symbols = resolve(value, "an expression")
        graph = graph_of([value], [symbol.symbol for symbol in symbols])
        return {
            "symbols": [self.written(symbol) for symbol in symbols],
            "instructions": [self._instruction(each) for each in graph.instructions],
            "result": graph.results[0],
        }

    def _instruction(self, instruction: Instruction) -> list[Any]:
        name = instruction.operation
        if name == "number":
            return [name, self.written(instruction.number)]
        if instruction.function is None:
            return [name, *instruction.operands]
        table = interpolant_of(instruction.function)
        if table is None:
            raise TypeError(
                f"an expression that calls the CasADi function '{instruction.function.name()}' "
                "cannot be saved with a solution; if it is a table, make it with ocp.Interpolant"
            )
        return [name, self.written(table), *instruction.operands]


class _Reader:
    """Builds the objects of a file, each from those before it."""

    def __init__(
        self, archive: zipfile.ZipFile, objects: list[Any], further: FurtherClass | None
    ) -> None:
        self.archive, self._further = archive, further
        self.objects = objects

    def read(self, value: Any) -> Any:
        """The value that was written."""
        if isinstance(value, list):
            return tuple(self.read(item) for item in value)
        if not isinstance(value, dict):
            return value
        ((kind, content),) = value.items()
        if kind == "number":
            return float(content)
        if kind == "list":
            return [self.read(item) for item in content]
        if kind == "mapping":
            return {self.read(key): self.read(item) for key, item in content}
        if kind == "bytes":
            return base64.b64decode(content)
        if kind == "object" and 0 <= content < len(self.objects):
            return self.objects[content]
        raise ValueError(f"it refers to {value!r}, which does not exist")

    def made(self, entry: Mapping[str, Any]) -> Any:
        """A new object."""
        if "array" in entry:
            with self.archive.open(f"{int(entry['array'])}.npy") as member:
                return np.lib.format.read_array(member, allow_pickle=False)
        if "instructions" in entry:
            return self._expression(entry)
        if entry["class"] == "Time":
            return TIME
        name = entry["class"]
        made = _classes().get(name) or (self._further and self._further(name))
        if not made:
            raise ValueError(f"it has an object of the unknown class {name!r}")
        values = {key: self.read(value) for key, value in entry["fields"].items()}
        if not set(values) <= set(_stored_fields(made)):
            raise ValueError(f"it has a {name} with other fields")
        with without_repeated_warnings():
            return made(**values)

    def _expression(self, entry: Mapping[str, Any]) -> ca.SX:
        symbols = [self.read(symbol) for symbol in entry["symbols"]]
        if not all(isinstance(symbol, Symbol) for symbol in symbols):
            raise ValueError("it has an expression that contains something other than symbols")
        instructions = tuple(self._instruction(*parts) for parts in entry["instructions"])
        graph = ExpressionGraph(instructions, (entry["result"],))
        (expression,) = graph.rebuilt([symbol.symbol for symbol in symbols])
        return ca.SX(expression)  # an object of its own, as what was written

    def _instruction(self, name: str, *rest: Any) -> Instruction:
        if name == "number":
            return Instruction(name, number=self.read(rest[0]))
        if name != "call":
            return Instruction(name, rest)
        table = self.read(rest[0])
        if not isinstance(table, Interpolant):
            raise ValueError("it has an expression that calls something other than a table")
        return Instruction(name, rest[1:], function=table.function)


@cache
def _stored_fields(kind: Callable[..., Any]) -> tuple[str, ...]:
    """Names of the fields that a file keeps: those of the constructor that a reader needs."""
    assert is_dataclass(kind)
    return tuple(f.name for f in fields(kind) if f.init and f.name[0] != "_" and f.name != "built")


def _tabulated(phase: Phase, problem: Problem | None) -> dict[Signal, Any]:
    """The guess of a phase, functions of time as tables (times, values)."""
    guess: dict[Signal, Any] = {}
    for signal, given in phase.guess.items():
        guess[signal] = given
        of_time = callable(given) or isinstance(given, ByFraction)
        if of_time and problem is not None:
            times = guessed_times(problem.phases)[phase.name]
            stated = StatedGuess(phase, (signal,), parameters_of(problem), times)
            fractions = np.linspace(0.0, 1.0, _SAMPLES)
            at = stated.start + fractions * (stated.end - stated.start)
            guess[signal] = at, stated.at_fractions(fractions)[signal.name]
    return guess


@cache
def _classes() -> dict[str, Callable[..., Any]]:
    """The classes whose objects a file may hold; their constructors check what they are given."""
    from ocp.mesh import mesh, trajectory
    from ocp.numerics import piecewise_polynomial, schemes
    from ocp.optimality import iterate, multipliers
    from ocp.problem import bounds, functionals, symbols
    from ocp.refinement import solved_mesh
    from ocp.reformulate import split_controls
    from ocp.scaling import scales
    from ocp.verification import simulation, verify

    listed = (
        *(symbols.State, symbols.Control, symbols.Algebraic, symbols.Unknown, symbols.Constant),
        *(split_controls.SumOfParts, symbols.Between, bounds.Bound, Phase, Problem, Form),
        *(functionals.Integral, functionals.Peak, functionals.BoundaryValue),
        *(functionals.PointValue, functionals.PhaseTime),
        *(Interpolant, *schemes.SCHEMES.values()),
        *(piecewise_polynomial.Bernstein, piecewise_polynomial.Lagrange),
        *(piecewise_polynomial.Piece, piecewise_polynomial.PiecewisePolynomial),
        *(mesh.PhaseMesh, mesh.ExtraPoints, mesh.Mesh, trajectory.Evaluator),
        *(trajectory.SignalGroup, trajectory.PhaseTrajectory, trajectory.Trajectory),
        *(scales.Scales, iterate.Iterate, solved_mesh.MeshIteration),
        *(multipliers.PhaseCostates, multipliers.PathMultiplier, multipliers.Multipliers),
        *(simulation.SimulatedPhase, simulation.SimulatedMotion),
        *(verify.Verification, Solution),
    )
    return {kind.__name__: kind for kind in listed}
