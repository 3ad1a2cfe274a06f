"""Settings of a solve, with defaults meant for problems nobody here has seen."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Integral
from typing import Any, get_args

from ocp.accuracy import ONE_NUMBER_OR_ALL, OneNumberOrAll
from ocp.errors import StatementError
from ocp.keywords import Remedy, as_written, checked_keywords
from ocp.nlp.ipopt import Ipopt
from ocp.nlp.solver import NlpSolver
from ocp.numerics.schemes import SCHEMES, Radau, Scheme
from ocp.problem.problem import Problem
from ocp.problem.symbols import Piecewise, is_real
from ocp.refinement.policies.adaptive_mesh import AdaptiveMesh
from ocp.refinement.policies.policy import MeshPolicy
from ocp.reformulate.reformulation import Reformulation
from ocp.reformulate.standard import STANDARD_REFORMULATIONS

INTERVALS = 20  # of the first mesh in a phase

# words of other tools
_ELSEWHERE: dict[str, Remedy] = {
    **dict.fromkeys(
        ("tol", "tolerance", "tolerances"),
        "write accuracy=1e-4, say, or Accuracy(dynamics=..., path=..., objective=..., replay=...)",
    ),
    "degree": "write scheme=Radau({value})",
    **dict.fromkeys(("N", "n", "nodes", "segments"), "write intervals={value}"),
    **dict.fromkeys(("method", "transcription"), "write scheme=Radau(4), or another scheme"),
    **dict.fromkeys(
        ("max_iter", "max_iterations"),
        "write iterations={value} for the whole solve, or solver=Ipopt(max_iterations={value}) for "
        "each mesh",
    ),
    **dict.fromkeys(("time_limit", "timeout"), "write seconds={value}"),
    **dict.fromkeys(("verbose", "print_level"), "write solve(problem, progress=True)"),
}


@checked_keywords(_ELSEWHERE)
@dataclass(frozen=True, repr=False)
class Settings:
    """How to discretise, refine, solve and verify.

    Parameters
    ----------
    scheme : Scheme
        Collocation scheme and degree of the first mesh. Refinement may raise the degree.
    intervals : int or mapping of phase name to int
        Of the uniform first mesh, in each phase, or by phase; 20 in a phase that is not named.
    controls : str
        Shape of controls that do not state their own: "constant", "linear", "polynomial",
        "automatic" or "full".
    refinement : MeshPolicy
        How the mesh adapts: `AdaptiveMesh` or `FixedMesh`, or a policy of one's own.
    solver : NlpSolver
        Of the nonlinear programs: `Ipopt`, or a solver of one's own. The default one is as tight as
        the accuracy needs, another one as it is stated.
    accuracy : float or Accuracy
        What refinement and verification allow. With one number, ``accuracy=1e-4``, objective,
        dynamics and limits hold to that, relative to their sizes, and so does the replay.
    reformulations : sequence of Reformulation
        What is done to a statement before it is solved, one after the other. By default kinks that
        only cost become limits of further signals and numbers; with ``()`` nothing is done. One of
        one's own may stand beside these: ``(*Settings().reformulations, own)``.
    verify : bool
        Whether to replay and check the answer; without, the verdict is "unverified".
    iterations : int, optional
        Budget of all mesh iterations together, None for no limit. When it is used up, the best one
        that holds between its points is verified and returned.
    seconds : float, optional
        The same in time [s].

    Raises
    ------
    StatementError
        For a value that makes no sense, or a keyword that is none.
    """

    scheme: Scheme = field(default_factory=Radau)
    intervals: int | Mapping[str, int] = INTERVALS
    controls: Piecewise = "automatic"
    refinement: MeshPolicy = field(default_factory=AdaptiveMesh)
    solver: NlpSolver = field(default_factory=Ipopt)
    accuracy: OneNumberOrAll = ONE_NUMBER_OR_ALL
    reformulations: Sequence[Reformulation] = STANDARD_REFORMULATIONS
    verify: bool = True
    iterations: int | None = None
    seconds: float | None = None

    def __repr__(self) -> str:
        return as_written(self)

    def __post_init__(self) -> None:
        _check_scheme(self.scheme)
        by_phase = self.intervals if isinstance(self.intervals, Mapping) else {"": self.intervals}
        for count in by_phase.values():
            _check_count("intervals", count)
        _check_choice("controls", self.controls, get_args(Piecewise))
        policies = "AdaptiveMesh() or FixedMesh()"
        _check_kind("refinement", self.refinement, MeshPolicy, policies)
        _check_kind("solver", self.solver, NlpSolver, "Ipopt()")
        object.__setattr__(self, "reformulations", _checked_passes(self.reformulations))
        _check_kind("verify", self.verify, bool, "True or False")
        _check_budget("iterations", self.iterations)
        _check_budget("seconds", self.seconds)

    @property
    def states_solver(self) -> bool:
        """Whether the solver is another one than the default, whose tolerances then hold."""
        return self.solver != Ipopt()


def first_intervals(settings: Settings, problem: Problem) -> tuple[int, ...]:
    """Intervals of the first mesh of each phase of a problem.

    Raises
    ------
    StatementError
        When the setting names a phase that the problem does not have.
    """
    names = [phase.name for phase in problem.phases]
    if not isinstance(settings.intervals, Mapping):
        return (settings.intervals,) * len(names)
    for name in settings.intervals:
        if name not in names:
            known = ", ".join(f"'{known}'" for known in names)
            raise StatementError(
                f"the setting 'intervals' names the phase {name!r}, which '{problem.name}' does "
                f"not have; its phases are {known}"
            )
    return tuple(settings.intervals.get(name, INTERVALS) for name in names)


def _check_scheme(scheme: Any) -> None:
    if isinstance(scheme, Scheme) and type(scheme) is not Scheme:
        return
    remedy = f"give one of {', '.join(f'{name}()' for name in SCHEMES)}"
    if isinstance(scheme, type) and issubclass(scheme, Scheme):
        remedy = f"write {scheme.__name__}()"
    for name, kind in SCHEMES.items():
        if scheme in (kind.name, name):
            remedy = f"write scheme={name}()"
    raise StatementError(f"the setting 'scheme' is {scheme!r}; {remedy}")


def _check_count(name: str, value: Any) -> None:
    if not isinstance(value, Integral) or value < 1:
        raise StatementError(f"the setting '{name}' is {value!r}; give a positive integer")


def _check_choice(name: str, value: Any, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise StatementError(
            f"the setting '{name}' is {value!r}; choose one of {', '.join(choices)}"
        )


def _check_kind(name: str, value: Any, kind: Any, examples: str) -> None:
    if isinstance(value, type) or not isinstance(value, kind):
        raise StatementError(f"the setting '{name}' is {value!r}; give {examples}")


def _checked_passes(given: Any) -> tuple[Reformulation, ...]:
    """Reformulations as a tuple; StatementError if one is none."""
    passes = tuple(given) if isinstance(given, (list, tuple)) else (given,)
    for each in passes:
        _check_kind("reformulations", each, Reformulation, "objects with a method apply, or ()")
        if type(each).__hash__ is None:
            raise StatementError(
                f"the reformulation {each!r} has no hash, which the engine needs to store its "
                "problems; if it is a dataclass, write @dataclass(frozen=True)"
            )
    return passes


def _check_budget(name: str, value: Any) -> None:
    if value is not None and not (is_real(value) and math.isfinite(value) and value > 0):
        raise StatementError(
            f"the budget '{name}' is {value!r}; give a positive number, or None for no budget"
        )
