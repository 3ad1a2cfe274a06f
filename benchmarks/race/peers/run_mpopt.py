"""mpopt: Radau collocation in equal segments, as in its examples; the peak is a parameter."""

import casadi as ca
import numpy as np
import problems
import row
from mpopt import mp

IMPORTED = row.now()
SIZE = {"A": 2500, "B": 200}  # segments
DEGREE = {"A": 1, "B": 4}  # in a segment: those that come closest


def statement(problem):
    """The problem in mpopt's terms: rows of path and terminal constraints are at most zero."""
    ocp = mp.OCP(n_states=3, n_controls=1, n_params=1)
    ocp.dynamics[0] = lambda x, u, t, a: [x[1], x[2], problems.UNIT_JERK[problem] * u[0]]
    ocp.terminal_costs[0] = lambda xf, tf, x0, t0, a: a[0]
    ocp.terminal_constraints[0] = lambda xf, tf, x0, t0, a: [xf[0] - problems.END, xf[1], xf[2]]
    if problem == "A":
        ocp.path_constraints[0] = lambda x, u, t, a: [
            x[2] / problems.UNIT_ACCELERATION - a[0],
            -x[2] / problems.UNIT_ACCELERATION - a[0],
        ]
    else:

        def path(x, u, t, a):
            force = problems.unit_force(ca, ca.if_else, x[0], x[1], x[2])
            return [force - a[0], -force]

        ocp.path_constraints[0] = path
        ocp.lbx[0] = np.array([-np.inf, 0.0, -np.inf])

    ocp.x00[0], ocp.xf0[0] = np.array([problems.START, 0, 0]), np.array([problems.END, 0, 0])
    ocp.lbu[0], ocp.ubu[0] = -1.0, 1.0
    ocp.lba[0], ocp.uba[0], ocp.a0[0] = 0.0, 100.0, 2.0
    ocp.lbtf[0] = ocp.ubtf[0] = ocp.tf0[0] = 1.0
    ocp.validate()
    return ocp


def solve(problem, size):
    """Return edges, places in a segment, the jerk there, and a note."""
    n, degree = size or SIZE[problem], DEGREE[problem]
    optimiser, post = mp.solve(
        statement(problem),
        n_segments=n,
        poly_orders=degree,
        scheme="LGR",
        plot=False,
        residual_dx=False,
    )

    # Segments share their end points.
    _, u, _, _ = post.get_original_data()
    shared = degree * np.arange(n)[:, None] + np.arange(degree + 1)
    edges, jerks = problems.in_si_units(problem, np.linspace(0, 1, n + 1), u[:, 0][shared])
    span = optimiser.tau1 - optimiser.tau0
    places = (optimiser._taus[degree] - optimiser.tau0) / span
    return edges, places, jerks, optimiser.nlp_solver.stats()["return_status"]


if __name__ == "__main__":
    *control, words = solve(*row.asked())
    row.answer(IMPORTED, *control, note=words)
