"""What is said of a sequence that does not come to rest."""

from types import SimpleNamespace

import numpy as np
import pytest

from ocp import Interrupted, SolveFailed
from studies.arm.optimal.refinement import Refined
from studies.arm.optimal.solve import solved
from studies.arm.questions.sequence.problem import sequence, sequence_problem
from studies.arm.questions.sequence.study import check_rest
from studies.arm.report import comparison_figures
from studies.common.exit_codes import ExitCode, StudyError


def found(left):
    replays = tuple(SimpleNamespace(residual_energy=energy) for energy in (1e-8, left))
    return Refined(None, replays, ((), (), ()), 1e-6)


def test_a_sequence_that_no_mesh_resolves_is_not_replayed_more_finely():
    with pytest.raises(
        StudyError, match=r"best of 3 rounds has a residual energy of 2\.80e-04 J"
    ) as refused:
        check_rest(found(2.8e-4), late=False)
    assert refused.value.exit_code is ExitCode.NOT_SOLVED


@pytest.mark.parametrize("left", [5e-7, 5e-6])
def test_a_sequence_near_rest_is_stated(left):
    check_rest(found(left), late=False)


@pytest.mark.parametrize(
    ("failure", "said"),
    [(SolveFailed("none"), StudyError), (Interrupted("stopped"), KeyboardInterrupt)],
)
def test_a_motion_that_is_not_found_is_said_in_a_sentence(failure, said):
    def fail(*_, **__):
        raise failure

    stated = sequence_problem(sequence(198.0, 10.0))
    with pytest.raises(said) as caught:
        solved("sequence", stated, 1e-5, None, (4, 2, 4), solver=fail)
    if said is StudyError:
        assert str(caught.value).startswith("no motion of the stages 'big' and 'small' was found")
        assert caught.value.exit_code is ExitCode.NOT_SOLVED


def test_both_panels_of_a_sequence_share_one_legend(monkeypatch):
    times = np.linspace(0.0, 1.0, 5)
    path = dict.fromkeys(("tip", "elbow"), np.zeros((2, 5)))
    trace = SimpleNamespace(times=times, path=path)
    monkeypatch.setattr(comparison_figures, "traced_laws", lambda result: ("big", "small"))
    monkeypatch.setattr(comparison_figures.Trace, "read", lambda result, name: trace)
    result = SimpleNamespace(details={"durations": (1.0, 0.5, 1.0)})
    figure = comparison_figures.sequence_motion_figure(result)
    assert len(figure.legends) == 1
    assert [text.get_text() for text in figure.legends[0].texts] == ["tip", "big arm's end"]
    assert all(panel.get_legend() is None for panel in figure.axes)
