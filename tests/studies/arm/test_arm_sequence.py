"""What is said of a sequence that does not come to rest."""

from types import SimpleNamespace

import pytest

from studies.arm.questions.sequence.refinement import RefinedSequence
from studies.arm.questions.sequence.study import check_rest
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
