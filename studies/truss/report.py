"""The verification record: what was checked, by what, to what tolerance."""

from __future__ import annotations

import dataclasses
from typing import Any

from studies.common.folder import ResultsFolder, provenance
from studies.truss.config import TrussStudy
from studies.truss.export import as_dictionary
from studies.truss.outcome import Outcome
from studies.truss.verify import checks, record


def accuracy(outcome: Outcome) -> dict[str, Any]:
    """What is known of the accuracy, for the head of an export."""
    verification = outcome.solution.verification
    return {
        "verdict": outcome.verdict,
        "solver_objective": verification.objective,
        "replayed_objective": verification.replayed_objective,
        "peaks": {
            name: {"solver": epigraph, "replayed_between_points": dense}
            for name, epigraph, dense in verification.peaks
        },
        "replay_miss_relative": verification.miss,
        "energy_imbalance_relative": outcome.deployment.energies.imbalance,
    }


def write_record(folder: ResultsFolder, study: TrussStudy, outcome: Outcome) -> bool:
    """Write `verification.json`; return whether everything passed."""
    found = record(checks(study, outcome.deployment))
    verification = outcome.solution.verification
    passed = bool(found["passed"]) and verification.passed
    content = {
        "passed": passed,
        "verdict": outcome.verdict,
        "remarks": list(outcome.remarks),
        "study": as_dictionary(study),
        "law": found["checks"],
        "engine": {
            "passed": verification.passed,
            "reasons": list(verification.reasons),
            "replay_miss_relative": verification.miss,
            "excess_relative": verification.excess,
            "peaks": [
                {"name": name, "solver": epigraph, "replayed_between_points": dense}
                for name, epigraph, dense in verification.peaks
            ],
            "rounds": [dataclasses.asdict(entry) for entry in outcome.solution.mesh_iterations],
        },
        "starts": [
            {"start": a.start, "value": a.value, "seconds": a.seconds, "failure": a.failure}
            for a in outcome.attempts
        ],
        "basins": [dataclasses.asdict(basin) for basin in outcome.basins],
        "bounds": dict(outcome.bounds),
        "values": outcome.deployment.values,
        "made_by": provenance(),
    }
    folder.write_json("verification.json", content)
    return passed
