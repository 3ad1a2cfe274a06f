"""Whether a best motion exists, and when enough starts have found it."""

from types import SimpleNamespace

import numpy as np
import pytest

from ocp import OcpError
from studies.cli import main
from studies.common.exit_codes import ExitCode
from studies.common.result import Result, Verdict
from studies.common.writers import exit_code
from studies.truss.motions.phase_plane import LeastForce
from studies.truss.search.verdict import AT_LIMIT, starts_agree, unattained_verdict

FORCE = ("truss", "--objective", "peak-force", "--duration", "6")


@pytest.mark.parametrize("caps", [(), ("--speed-cap", "100"), ("--acceleration-cap", "1e5")])
def test_a_cap_that_cannot_act_changes_nothing(caps, capsys) -> None:
    assert main([*FORCE, *caps]) == ExitCode.INFEASIBLE
    last = capsys.readouterr().err.splitlines()[-1]
    assert "no minimum exists: the peak rope force can approach 12.2884 N" in last
    assert "but not reach it" in last


def test_a_motion_at_a_limit_says_so_and_ends_in_its_own_code() -> None:
    # a dip of the speed, where the motion nearly rests
    speed, angle = np.array([0.0, 1.0, 0.5, 1.0]), np.array([0.1, 0.5, 1.5, 1.57])
    motion = SimpleNamespace(speed=speed, angle=angle, force=12.0 * (1 + 1e-8))
    limit, met = (LeastForce(12.0, attained, motion) for attained in (False, True))
    at = unattained_verdict(12.0 * (1 + 0.5 * AT_LIMIT), limit)
    assert at is not None
    assert at.sentence.startswith("no minimum exists")
    assert unattained_verdict(12.0 * (1 + 2 * AT_LIMIT), limit) is None
    assert unattained_verdict(12.0, met) is None
    result = Result("truss", "?", {}, verdict=at)
    assert not result.passed
    assert exit_code(result) == ExitCode.INFEASIBLE
    assert exit_code(Result("truss", "?", {}, verdict=Verdict("none", ""))) != exit_code(result)


STARTS = ("bezier", "dwell", "step5", "straight")


@pytest.mark.parametrize(
    ("values", "enough"),
    [
        ({"bezier": 1.0}, False),
        ({"bezier": 1.0, "step5": 1.0}, False),  # no start of the other kind
        ({"bezier": 1.0, "dwell": 1.00001}, True),
        ({"bezier": 1.0, "dwell": 0.9}, False),  # the best one was found once
        ({"bezier": 1.0, "dwell": 0.9, "step5": 1.0}, False),
        ({"bezier": 1.0, "dwell": 1.1, "step5": 1.0}, True),
        ({"bezier": 1.0, "dwell": None, "step5": 1.0}, False),
        ({"neighbour": 1.0, "bezier": 1.0}, True),
        ({"neighbour": 1.0, "bezier": 0.9}, False),
    ],
)
def test_the_search_ends_where_two_starts_found_the_best_and_each_kind_has_run(
    values: dict[str, float | None], enough: bool
) -> None:
    trials = [
        SimpleNamespace(name=name, value=value, error=None if value else OcpError("failed"))
        for name, value in values.items()
    ]
    assert starts_agree(STARTS, trials, 1e-4) is enough
