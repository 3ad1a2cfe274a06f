"""Rows of section III: the ANCF element, its equations of motion and the two pendulums.

Symbols: e element coordinates (8,), L length [m], q node coordinates, alpha, beta stabilisation
[1/s], lambda multipliers.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np

import studies
from models.ancf.element import element_kernel, mass_matrix, moment_force, shape_row
from models.ancf.integrate import simulate
from models.ancf.joints import Free
from models.ancf.motion import Index1
from models.ancf.state import posed
from models.arm.parameters import single_pendulum
from models.numerics import gauss_legendre
from ocp.arrays import Array
from studies.paper.cases import PENDULUM_TIMES, Cases
from studies.paper.entries import Entry, assumption, formula, given, misprint, not_readable, shape

L, EA, EI, DENSITY = 0.7, 3.0e6, 40.0, 1.3  # of an element for the formulas: any will do
STABILISATIONS = (5.0, 50.0)  # [1/s], the range of the paper
OURS = 20.0  # [1/s], our default
PRESETS = Path(studies.__path__[0]) / "flex" / "presets"


def flexible_entries(cases: Cases) -> list[Entry]:
    """The rows, in the order of the paper."""
    return [*_element(), *_equations(cases), *_table_1(), *_figures(cases)]


def _bent() -> Array:
    """Coordinates of an element that is bent and stretched."""
    return np.array([0.1, -0.2, 1.05, 0.12, 0.78, 0.05, 0.9, 0.35])


def _written_rows(xi: float) -> Array:
    """S_1 to S_4 below (3)."""
    return np.array(
        [
            1 - 3 * xi**2 + 2 * xi**3,
            L * (xi - 2 * xi**2 + xi**3),
            3 * xi**2 - 2 * xi**3,
            L * (xi**3 - xi**2),
        ]
    )


def _secant(e: Array) -> Array:
    """K_l + K_n of (8)-(9), with quadrature far beyond what is needed; (8, 8)."""
    stiffness = np.zeros((8, 8))
    for xi, weight in zip(*gauss_legendre(8), strict=True):
        first, second = (np.kron(shape_row(xi, L, order), np.eye(2)) for order in (1, 2))
        square = first.T @ first
        bending = EI * second.T @ second
        stiffness += weight * L * (bending + EA / 2 * (e @ square @ e - 1) * square)
    return stiffness


def _element() -> list[Entry]:
    e = _bent()
    xis = np.linspace(0.0, 1.0, 11)
    rows = max(float(np.abs(shape_row(xi, L) - _written_rows(xi)).max()) for xi in xis)

    # (5) by quadrature of the shape functions
    mass = np.zeros((8, 8))
    for xi, weight in zip(*gauss_legendre(6), strict=True):
        S = np.kron(_written_rows(xi), np.eye(2))
        mass += weight * L * DENSITY * S.T @ S
    models = mass_matrix(L, DENSITY)

    energy, gradient, tangent = element_kernel()(e, EA, EI, L)
    secant = _secant(e)
    force = secant @ e
    gap = float(np.abs(force - gradient.full().ravel()).max() / np.abs(force).max())
    lacking = float(np.linalg.norm(tangent.full() - secant) / np.linalg.norm(tangent.full()))

    # (10): work of a unit moment over a turn of the slope on which it acts
    slope = e[2:4]
    turn = np.array([-slope[1], slope[0]])
    work = float(np.dot(moment_force(slope[0], slope[1], 1.0), turn))
    return [
        given("(2)-(3), Fig. 4", "coordinates of an element", "1", "8", e.size),
        formula("(2)", "shape functions S1 to S4", rows),
        formula(
            "(4)-(5)", "mass matrix, constant", float(np.abs(mass - models).max() / models.max())
        ),
        formula("(6)-(7)", "strain energy", abs(_energy(e) / float(energy) - 1)),
        formula("(8)-(9)", "elastic force K e, the gradient of (6)", gap),
        misprint(
            "(8)",
            "K as two derivatives of (6): share of the Hessian that K_l + K_n lacks",
            "1",
            "0",
            lacking,
            "(9) is the secant stiffness: the Hessian has one term more, which Newton steps need",
            shown=gap < 1e-9,
        ),
        misprint(
            "(10)",
            "work of a moment on the left node over a turn of its own slope",
            "1",
            "0",
            work,
            "the force labelled 'left' acts on e7 and e8, the slope of the right node, and the "
            "other way round",
            shown=abs(work - 1.0) < 1e-12,
        ),
        misprint(
            "(10)",
            "entries of the vector of generalised forces",
            "1",
            "7",
            e.size,
            "a zero is missing: the element has eight coordinates",
        ),
    ]


def _energy(e: Array) -> float:
    """U of (6) with (7) [J]."""
    total = 0.0
    nodes = e.reshape(4, 2).T
    for xi, weight in zip(*gauss_legendre(8), strict=True):
        slope, curve = (nodes @ shape_row(xi, L, order) for order in (1, 2))
        strain = (slope @ slope - 1) / 2
        total += weight * L * (EA * strain**2 + EI * curve @ curve) / 2
    return float(total)


def _equations(cases: Cases) -> list[Entry]:
    chain = single_pendulum(4)
    state, joints = posed(chain), [Free()]
    form = Index1(chain, joints)
    solved, N = form.start(0.0, state.q, state.v)
    zero = np.zeros(1)
    columns = (part[:, None] for part in (state.q, state.v, solved, N))
    left = float(np.abs(form.residual(zero, *columns)[0]).max())
    tip = chain.slots(0, -1)[1]

    times = np.linspace(0.0, PENDULUM_TIMES["single"], 53)
    reference = simulate(chain, joints, state, times)
    found = [
        misprint(
            "(13)",
            "first unknown at the release of the single pendulum, vertical, at its tip",
            "m/s^2",
            "0",
            float(solved[tip]),
            "printed as the velocity, which is zero there: the rows of (13) hold for the "
            "acceleration, with two dots as in (14)",
            shown=left < 1e-6,
        )
    ]
    for value, end in zip(STABILISATIONS, ("least", "greatest"), strict=True):
        run = simulate(chain, joints, state, times, form="index-1", stabilisation=(value, value))
        tips = np.abs(run.position(0) - reference.position(0)).max()
        gap = float(run.violation.max())
        found.append(
            shape(
                "(14)",
                f"{end} stability factor, alpha = beta, of the single pendulum",
                "1/s",
                value,
                {
                    "stable at this end of the range": bool(np.isfinite(run.q).all()),
                    f"the constraints stay closed, to {gap:.0e} m": gap < 1e-6,
                    f"the motion of eliminated constraints, to {tips:.0e} m": float(tips) < 1e-5,
                },
                printed=f"{value:g}",
            )
        )
    found.append(
        assumption(
            "(14)",
            "stability factors alpha and beta",
            "1/s",
            OURS,
            "the paper gives a range, 5 to 50; ours lie within, and are critical as alpha = beta",
        )
    )
    return found


def _table_1() -> list[Entry]:
    titles = ("length", "cross-sectional area", "elastic modulus", "second moment of area")
    found = []
    for name, column, printed in (
        ("single-pendulum", "simple", ("1.2", "0.0018", "2e9", "1.215e-8", "5540", "1.3")),
        ("double-pendulum", "double", ("3.6", "0.00025", "6.895e10", "1.302e-9", "2770", "5")),
    ):
        case = tomllib.loads((PRESETS / f"{name}.toml").read_text("utf-8"))
        links, reason = case["link"], f"the value of our case {name}"

        # the paper's length is that of the whole chain; the links are alike in all else
        length = sum(link["length"] for link in links)
        keys = ("area", "modulus", "second_moment", "density")
        rows = zip(
            (*titles, "density", "simulation time"),
            ("m", "m^2", "Pa", "m^4", "kg/m^3", "s"),
            printed,
            (length, *(links[-1][key] for key in keys), case["duration"]),
            strict=True,
        )
        found += [
            given("Table 1", f"{title}, {column} pendulum", unit, digits, value, reason)
            for title, unit, digits, value in rows
        ]

        gravity = -case["gravity"][1]
        found.append(
            given("Table 1", f"gravity, {column} pendulum", "m/s^2", "9.81", gravity, reason)
        )
    return found


def _figures(cases: Cases) -> list[Entry]:
    found = [
        assumption(
            "Fig. 5",
            "angle at which both pendulums are released",
            "deg",
            0.0,
            "a drawing without numbers; ours start straight, horizontal and at rest",
        )
    ]
    for panel, name in (("a", "single"), ("b", "double")):
        run = cases.pendulums[name]
        height = run.position(len(run.chain.links) - 1)[1]
        drift = run.drift / float(run.kinetic.max())
        found.append(
            not_readable(
                f"Fig. 6({panel})",
                f"height of the {name} pendulum's tip at the end",
                "m",
                float(height[-1]),
                f"lowest {height.min():.4f} m; the energy drifts by {drift:.0e} of its kinetic "
                "part; the two pendulums are held against reference runs in the tests",
            )
        )
    return found
