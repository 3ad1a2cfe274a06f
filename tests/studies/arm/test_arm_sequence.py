"""What is said of a sequence that does not come to rest."""

from types import SimpleNamespace

import numpy as np
import pytest

from ocp import Interrupted, SolveFailed
from studies.arm.questions.sequence import solve as solving
from studies.arm.questions.sequence.refinement import RefinedSequence
from studies.arm.questions.sequence.study import check_rest
from studies.arm.report import comparison_figures
from studies.arm.stage import big_arm, small_arm
from studies.common.exit_codes import ExitCode, StudyError


def found(left):
    return RefinedSequence(None, SimpleNamespace(left=left), ((), (), ()), 1e-6, 0.0)


def test_a_sequence_that_no_mesh_resolves_is_not_replayed_more_finely():
    with pytest.raises(StudyError, match=r"best of 3 rounds leaves 2\.80e-04 J") as refused:
        check_rest(found(2.8e-4))
    assert refused.value.exit_code is ExitCode.NOT_SOLVED


@pytest.mark.parametrize("left", [5e-7, 5e-6])
def test_a_sequence_near_rest_is_stated(left):
    check_rest(found(left))


@pytest.mark.parametrize(
    ("failure", "said"),
    [(SolveFailed("none"), StudyError), (Interrupted("stopped"), KeyboardInterrupt)],
)
def test_a_stage_alone_that_is_not_found_is_said_in_a_sentence(failure, said, monkeypatch):
    """What was found of the sequence until then is kept, as the study leaves such a part out."""

    def fail(*_, **__):
        raise failure

    monkeypatch.setattr(solving, "stage_alone", lambda *_: None)
    case = SimpleNamespace(first=big_arm(), second=small_arm(), moving_time=20.0)
    with pytest.raises(said) as caught:
        solving.alone(case, cap=10.0, solver=fail)
    if said is StudyError:
        assert str(caught.value).startswith("no motion of the big arm alone was found")
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
