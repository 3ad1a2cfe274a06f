"""Settings of a solve, with defaults meant for problems nobody here has seen."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from numbers import Integral
from typing import Literal

from ocp.errors import StatementError
from ocp.nlp.ipopt import IpoptOptions
from ocp.numerics.schemes import SchemeName
from ocp.problem.symbols import ControlShape


@dataclass(frozen=True)
class Settings:
    """How to discretise, refine, solve and verify.

    Attributes
    ----------
    scheme, degree, intervals : transcription and the uniform mesh of the first round (per phase);
        the degree is raised where a higher one integrates the dynamics exactly.
    control_shape : of controls that do not state their own.
    refine : whether to adapt the mesh.
    dynamics_tolerance : integrated residual of the dynamics per interval, relative.
    path_tolerance : excess of peaks, path constraints and bounds between the points, relative.
    objective_tolerance : relative change of the optimum in the last refinement of the controls.
    replay_tolerance : miss of the replayed end state, relative.
    rounds, most_intervals : limits of the adaptation.
    solver : "ipopt", or "fatrop" with IPOPT wherever fatrop fails or has too many intervals; the
        record of the rounds says what ran.
    iterations, seconds : budget of all rounds together, None for no limit.  When it is used up,
        the best round that holds between its points is verified and returned.
    verify : whether to replay and check the answer; without, the verdict is "unverified".
    compile : whether to compile the model's functions to machine code: pays for large right-hand
        sides on thousands of intervals; needs a C compiler, and keeps what it made for next time.
    """

    scheme: SchemeName = "radau"
    degree: int = 4
    intervals: int = 20
    control_shape: ControlShape = "automatic"
    refine: bool = True
    dynamics_tolerance: float = 1e-7
    path_tolerance: float = 1e-7
    objective_tolerance: float = 1e-6
    replay_tolerance: float = 1e-6
    rounds: int = 25
    most_intervals: int = 4000
    highest_degree: int = 8
    move_breakpoints: bool = True
    solver: Literal["ipopt", "fatrop"] = "ipopt"
    iterations: int | None = None
    seconds: float | None = None
    verify: bool = True
    compile: bool = False
    ipopt: IpoptOptions = field(default_factory=IpoptOptions)

    def __post_init__(self) -> None:
        for name in ("degree", "intervals", "rounds", "most_intervals", "highest_degree"):
            value = getattr(self, name)
            if not isinstance(value, Integral) or value < 1:
                raise StatementError(f"the setting '{name}' is {value!r}; give a positive integer")
        if self.solver not in ("ipopt", "fatrop"):
            raise StatementError(f"the setting 'solver' is {self.solver!r}; choose ipopt or fatrop")
        for name in ("iterations", "seconds"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise StatementError(
                    f"the budget '{name}' is {value!r}; give a positive number, or None for none"
                )
        for name in ("dynamics", "path", "objective", "replay"):
            value = getattr(self, f"{name}_tolerance")
            if not (math.isfinite(value) and value > 0):
                raise StatementError(
                    f"the setting '{name}_tolerance' is {value!r}; give a positive number"
                )
