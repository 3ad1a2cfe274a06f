"""Every row of a program has a name, in the words of the statement."""

import numpy as np
import pytest

from ocp import (
    Algebraic,
    Between,
    Bound,
    Control,
    Gauss,
    HermiteSimpson,
    Mesh,
    Phase,
    Problem,
    Radau,
    State,
    joined,
    peak,
)
from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.mesh import ExtraPoints, PhaseMesh, uniform
from ocp.nlp.failures import row_kinds
from ocp.problem.parameters import parameters_of
from ocp.scaling.automatic import scales_of
from ocp.transcription.transcribe import Transcription, transcribe


def everything(scheme) -> Transcription:
    """Two phases with rows of all kinds: moving breakpoints, added points, a bounded integral."""
    x, v, z = State("x", "m", scale=2), State("v", "m/s"), Algebraic("z")
    u = Control("u", "m/s^2", lower=-1, upper=1)
    law = Bound("law", z - x, lower=0, upper=0)
    cap = Bound("cap", x + v, "m", upper=3)
    first = Phase("first", {x: v, v: u}, {x: 0, v: 0}, end=Between(1, 3), bounds=[law, cap])
    second = Phase("second", {x: v, v: u}, final={x: 1, v: 0}, start=Between(1, 3), end=4.0)
    effort = Bound("effort", first.integral(u**2, name="work"), "m^2/s^3", upper=2)
    problem = Problem(
        "everything",
        [first, second],
        minimise=peak((first, v), (second, -v), name="speed"),
        bounds=[effort],
        links=joined(first, second),
    )
    moving = PhaseMesh(np.array([0, 0.3, 0.5, 1.0]), np.array([3, 3, 4]), (1,))
    extra = ExtraPoints(1, np.array([1, 2]), np.array([0.25, 0.75]))
    mesh = Mesh((moving, uniform(2, 3)), ((extra,), ()))
    parameters = parameters_of(problem)
    scales = scales_of(problem, initial_guess(problem, parameters), parameters)
    return transcribe(problem, mesh, scheme, "automatic", scales)


@pytest.mark.parametrize("scheme", [Radau(3), Gauss(3), HermiteSimpson()], ids=lambda s: s.name)
def test_every_row_belongs_to_one_kind(scheme) -> None:
    program = everything(scheme)
    rows = np.concatenate([kind.rows for kind in row_kinds(program)])
    np.testing.assert_array_equal(np.sort(rows), np.arange(program.program.rows))


def test_names_places_units_and_sizes() -> None:
    kinds = {(kind.phase, kind.what): kind for kind in row_kinds(everything(Radau(3)))}
    dynamics = kinds["first", "dynamics of 'x'"]
    assert (dynamics.unit, dynamics.size) == ("m", 2.0)
    points = Radau().at(3).points
    assert dynamics.fractions is not None
    expected = [*(0.3 * points), *(0.3 + 0.2 * points), *(0.5 + 0.5 * Radau().at(4).points)]
    np.testing.assert_allclose(np.sort(dynamics.fractions), expected, rtol=1e-14)

    # at the collocation points, at both added points, and at the start of the phase
    cap = kinds["first", "'cap'"]
    assert cap.fractions is not None
    np.testing.assert_allclose(np.sort(cap.fractions), np.sort([*expected, 0, 0.35, 0.875]))

    assert kinds["first", "integral 'work'"].rows.size == 3
    assert kinds["first", "duration"].unit == "s"
    assert kinds["first", "order of the breakpoints"].rows.size == 2
    assert kinds["", "'effort'"].unit == "m^2/s^3"
    assert ("", "'x from first to second'") in kinds
    assert ("second", "'speed'") in kinds


def test_ends_of_intervals_without_a_point_there_are_named() -> None:
    kinds = {(kind.phase, kind.what): kind for kind in row_kinds(everything(Gauss(3)))}
    joint = kinds["second", "continuity of 'v'"]
    assert joint.fractions is not None
    assert joint.fractions.tolist() == [0.5, 1.0]
