"""Fatrop, an interior-point solver for programs in stages, where it can be used.

Vanroye, Sathya, De Schutter, Decre, "FATROP: a fast constrained optimal control problem solver for
robot trajectory optimization and control", IROS 2023.
"""

from __future__ import annotations

import logging
import time as clock
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.nlp.ipopt import IpoptOptions, NlpResult
from ocp.stages import Stages, in_stages
from ocp.transcription.kernels import Program
from ocp.transcription.transcribe import Transcription

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
# CasADi lays out the stages one after the other in a growing matrix: 0.5 s for 200, 14 s for 1000
MOST_STAGES = 250
_MOST_ITERATIONS = 300  # it either takes some tens or stalls
_LOOSENED = 1e-8
log = logging.getLogger(__name__)


def run_fatrop(
    transcription: Transcription, x0: Array, column_limits: tuple[Array, Array],
    row_limits: tuple[Array, Array], constants: Array, options: IpoptOptions,
) -> NlpResult | None:  # fmt: skip
    """Run fatrop from `x0`; None where it is missing, is not meant for the size, or fails."""
    begin, program = clock.perf_counter(), transcription.program
    if not ca.has_nlpsol("fatrop"):
        log.warning("this CasADi has no fatrop; IPOPT solves instead")
        return None
    if transcription.mesh.intervals > MOST_STAGES:
        log.info("fatrop is for at most %d intervals; IPOPT solves instead", MOST_STAGES)
        return None
    stages = in_stages(transcription.blocks, transcription.layouts, program)
    limits = stages.column_limits(column_limits), stages.row_limits(row_limits)
    settled = _rows_of_fixed(program, column_limits[0] == column_limits[1])
    free = np.where(settled, -np.inf, row_limits[0]), np.where(settled, np.inf, row_limits[1])
    tight = [_tightened(*limits[0]), _tightened(*stages.row_limits(free))]
    x, p = ca.MX.sym("x", stages.program.variables), ca.MX.sym("p", program.constants)
    f, g = stages.program.oracle(x, p)
    try:
        solver = ca.nlpsol(
            "solver", "fatrop", {"x": x, "p": p, "f": f, "g": g},
            _settings(stages, tight[1][0] == tight[1][1], options),
        )  # fmt: skip
        result = solver(
            x0=x0[stages.variables], p=constants, lbx=tight[0][0], ubx=tight[0][1],
            lbg=tight[1][0], ubg=tight[1][1],
        )  # fmt: skip
    except RuntimeError as error:
        log.info("fatrop refused '%s': %s", transcription.problem.name, error)
        return None
    found = {key: np.array(value).ravel() for key, value in result.items()}
    made = NlpResult(
        outcome="solved", status="Fatrop_Succeeded", x=stages.plain(found["x"]),
        objective=float(found["f"][0]), rows=found["g"][stages.rows],
        bound_multipliers=stages.plain(found["lam_x"]),
        row_multipliers=found["lam_g"][stages.rows],
        iterations=int(solver.stats()["iter_count"]), seconds=clock.perf_counter() - begin,
        solver="fatrop",
    )  # fmt: skip
    excess = max(_excess(found["g"], limits[1]), _excess(found["x"], limits[0]))
    if not solver.stats()["success"] or not excess <= options.constraint_violation:
        log.info("fatrop did not solve '%s' (excess %.1e); IPOPT solves instead",
                 transcription.problem.name, excess)  # fmt: skip
        return None
    return made


def _settings(stages: Stages, equations: Flags, options: IpoptOptions) -> dict[str, Any]:
    return {
        "structure_detection": "manual", "N": stages.states.size - 1,
        "nx": stages.states.tolist(), "nu": stages.controls.tolist(), "ng": stages.paths.tolist(),
        "equality": equations.tolist(), "print_time": False, "show_eval_warnings": False,
        "calc_lam_p": False,
        "fatrop": {
            "print_level": options.print_level, "tolerance": options.tolerance,
            "max_iter": min(options.max_iterations, _MOST_ITERATIONS), "acceptable_iter": 8,
            "tol_acceptable": 100.0 * options.tolerance,
        },
    }  # fmt: skip


def _rows_of_fixed(program: Program, fixed: Flags) -> Flags:
    """The rows that depend on fixed unknowns alone: equations among them have no full rank."""
    pattern = program.constraint_jacobian.sparsity_out(1)
    rows, columns = (np.array(places, dtype=np.int64) for places in pattern.get_triplet())
    return np.bincount(rows[~fixed[columns]], minlength=program.rows) == 0


def _tightened(lower: Array, upper: Array) -> tuple[Array, Array]:
    """Limits that fatrop, which loosens them by 1e-8, turns into those given."""
    low, high = (np.abs(np.where(np.isfinite(side), side, 0.0)) for side in (lower, upper))
    inside = (lower + _LOOSENED * np.maximum(low, 1.0), upper - _LOOSENED * np.maximum(high, 1.0))
    wide = inside[0] < inside[1]
    return np.where(wide, inside[0], lower), np.where(wide, inside[1], upper)


def _excess(values: Array, limits: tuple[Array, Array]) -> float:
    """How far values exceed their limits; infinite for values that are no numbers."""
    excess = np.maximum(limits[0] - values, values - limits[1])
    return float(np.max(np.where(np.isfinite(values), excess, np.inf), initial=0.0))
