"""The runs of IPOPT that one mesh round may take."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ocp.mesh.initial_guess import start_of
from ocp.nlp.ipopt import Duals, IpoptOptions, Listener, NlpResult, run
from ocp.optimality.warm_start import Origin
from ocp.refinement.budget import Budget
from ocp.settings import Settings
from ocp.transcription.packing import decision_vector
from ocp.transcription.transcribe import Transcription

_PATIENCE = 300  # iterations of a warm start from the round before


def solve_round(
    transcription: Transcription, origin: Origin, constants: Mapping[str, float],
    settings: Settings, budget: Budget, before: int, listener: Listener | None = None,
) -> NlpResult:  # fmt: skip
    """Solve one transcription; what every attempt took is counted.

    Fatrop comes first where it was asked for.  With known multipliers the first attempt of IPOPT
    is a warm start; in later rounds one that takes long has lost its way, and is made once more
    with another line search.  If it fails, and without multipliers, the start is primal: under
    the user's options in the first round, with a monotone barrier, which strays less from a good
    start, in later ones, and under the user's options if that fails too.

    Parameters
    ----------
    before : iterations of the rounds before this one; 0 for the first.
    """
    start = start_of(transcription.problem, constants, origin.trajectory)
    x0 = decision_vector(transcription, start, constants)
    if origin.program is not None and origin.program.transcription is transcription:
        x0 = origin.program.x  # to the last digit, which its multipliers belong to
    parameters = np.array([constants[c.name] for c in transcription.problem.constants])
    limits = transcription.columns.evaluate(constants), transcription.rows.evaluate(constants)
    if settings.solver == "fatrop":
        from ocp.fatrop import run_fatrop

        options = budget.within(settings.ipopt, before)
        fast = run_fatrop(transcription, x0, *limits, parameters, options)
        if fast is not None:
            return fast
    iterations, seconds = 0, 0.0
    small = transcription.condensed
    known = origin.duals(transcription)
    known = None if known is None else small.duals(known, x0, parameters)
    for choice, duals in _attempts(known, settings.ipopt, before == 0):
        allowed = budget.within(choice, before + iterations)
        result = run(small.program, x0[small.columns], *small.limits(*limits), parameters,
                     allowed, listener=listener, multipliers=duals)  # fmt: skip
        iterations, seconds = iterations + result.iterations, seconds + result.seconds
        if result.outcome in ("solved", "interrupted") or budget.spent(before + iterations):
            break
    result = small.expanded(result, limits[0], parameters)
    return replace(result, iterations=iterations, seconds=seconds)


def _attempts(
    duals: Duals | None, options: IpoptOptions, first: bool
) -> Iterator[tuple[IpoptOptions, Duals | None]]:
    """Options and multipliers of the attempts, in order."""
    if duals is not None and first:
        yield options, duals
    elif duals is not None:
        short = replace(options, max_iterations=min(options.max_iterations, _PATIENCE))
        yield short, duals
        yield replace(short, line_search="cg-penalty"), duals
    if not first:
        yield replace(options, barrier="monotone"), None
    yield options, None
