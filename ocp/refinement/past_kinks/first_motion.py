"""What comes of the first mesh: from its start, past kinks, or from other starts."""

from __future__ import annotations

import math

from ocp.nlp.result import NlpResult
from ocp.refinement.better_motions.across_known_times import across_known_times
from ocp.refinement.first_round.first_answer import first_answer
from ocp.refinement.first_round.starts import MeshAnswer, MeshRound
from ocp.refinement.mesh_solver import Start
from ocp.refinement.past_kinks.past_kinks import (
    PATIENCE,
    is_lost,
    may_be_lost,
    past_kinks,
)
from ocp.transcription.transcribe import Transcription


def first_motion(first_round: MeshRound, start: Start, program: Transcription) -> MeshAnswer:
    """The first mesh solved, or what failed.

    Parameters
    ----------
    start : Iterate, Trajectory or None
        Where it starts; None for the guess in the statement.
    """
    found = _on_its_side(first_round, start, program)
    return across_known_times(first_round.meshes, first_round.solver, first_round.before, found)


def _on_its_side(first_round: MeshRound, start: Start, program: Transcription) -> MeshAnswer:
    """The same, phases that begin or end at a known time left at it."""
    meshes, kinked = first_round.meshes, may_be_lost(first_round.meshes, start)
    patience = PATIENCE if kinked else math.inf
    result = meshes.solve(program, start, first_round.solver, first_round.before, most=patience)
    if kinked and is_lost(result):
        found = past_kinks(first_round, start, program, result)
        if found.result.outcome in ("solved", "interrupted"):
            return found
        result = _without_haste(first_round, start, found)
    answer = MeshAnswer(program, result)
    if start is not None:
        return answer
    if result.outcome != "solved":
        # what cannot be met on one side of a known time is met on another one sooner than from
        # other starts
        answer = across_known_times(meshes, first_round.solver, first_round.before, answer)
    return first_answer(first_round, answer.program, answer.result)


def _without_haste(first_round: MeshRound, start: Start, failed: MeshAnswer) -> NlpResult:
    """The first mesh from its start again, for as long as the solver may take."""
    meshes, program = first_round.meshes, failed.program
    point = meshes.starting_point(program, start, meshes.limits(program))
    patient = first_round.runs(program, [(first_round.solver, point)], failed.result, math.inf)
    return next(patient, failed.result)
