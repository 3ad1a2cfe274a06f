import numpy as np
import pytest

from models.ancf.chain import Chain, Link
from models.ancf.integrate import StepControl, simulate
from models.ancf.integrate.radau import radau
from models.ancf.joints import Free
from models.ancf.state import posed
from models.errors import ModelError


@pytest.mark.parametrize("stages", [3, 5, 7])
def test_quadrature_is_exact_to_degree_2s_minus_2(stages):
    table = radau(stages)
    for degree in range(2 * stages - 1):
        value = table.matrix[-1] @ table.nodes**degree
        assert value == pytest.approx(1 / (degree + 1), rel=1e-12)
    assert table.matrix[-1] @ table.nodes ** (2 * stages - 1) != pytest.approx(
        1 / (2 * stages), rel=1e-9
    )


@pytest.mark.parametrize("stages", [3, 5, 7])
def test_eigen_decomposition_restores_the_butcher_matrix(stages):
    table = radau(stages)
    again = ((table.inverse.T * table.values) @ table.joined).real
    assert pytest.approx(table.matrix, abs=1e-13) == again.T


def test_weights_integrate_the_stage_polynomial():
    table, theta = radau(5), np.array([0.0, 0.3, 1.0, 1.4])
    stage = table.nodes**3
    assert table.weights(theta, 0) @ stage == pytest.approx(theta**3, abs=1e-13)
    assert table.weights(theta, 1) @ stage == pytest.approx(theta**4 / 4, abs=1e-13)
    assert table.weights(theta, 2) @ stage == pytest.approx(theta**5 / 20, abs=1e-13)


@pytest.mark.parametrize(("stages", "steps"), [(3, (80, 160)), (5, (24, 32))])
def test_observed_order_is_2s_minus_1(stages, steps):
    # a rubber link of one element: all its modes are resolved by the steps
    chain = Chain((Link(1.0, 200.0, 0.5, 1.0),), 1, gravity=(0.0, -9.81))
    times = np.array([0.0, 0.4])

    def end(count: int, s: int = stages) -> np.ndarray:
        fixed = StepControl(1e-12, s, fixed_step=0.4 / count)
        return simulate(chain, [Free()], posed(chain), times, settings=fixed).q[:, -1]

    exact = end(150, 7)
    errors = [np.abs(end(count) - exact).max() for count in steps]
    order = np.log(errors[0] / errors[1]) / np.log(steps[1] / steps[0])
    assert order == pytest.approx(2 * stages - 1, abs=0.5)


def test_other_stage_counts_are_refused():
    with pytest.raises(ModelError, match="stages is 4; use 3, 5 or 7"):
        StepControl(stages=4)
