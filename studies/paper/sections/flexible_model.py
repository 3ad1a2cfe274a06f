"""Rows of section III: the ANCF element, its equations of motion and the two pendulums.

Symbols: e element coordinates (8,), L length [m], q node coordinates (8,), v their rates, alpha,
beta stabilisation [1/s].
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np

import studies
from models.ancf.chain import Chain, Link
from models.ancf.element import element_kernel, mass_matrix, moment_force, shape_row
from models.ancf.integrate import StepControl, simulate
from models.ancf.joints import Free, Joint, Locked
from models.ancf.motion import Index1
from models.ancf.state import posed
from models.arm.parameters import GRAVITY, double_pendulum, single_pendulum
from models.numerics import gauss_legendre
from ocp.arrays import Array
from studies.paper.cases import Cases
from studies.paper.entries import (
    EXACT,
    FORMULA,
    Entry,
    apart,
    assumption,
    exact,
    formula,
    misprint,
    not_readable,
    shape,
    taken,
)

ELEMENT = Link(0.7, 3.0e6, 40.0, 1.3)  # for the formulas: any will do
L, EA, EI = ELEMENT.length, ELEMENT.axial_stiffness, ELEMENT.bending_stiffness
STABILISATIONS = (5.0, 50.0)  # [1/s], the range of the paper
OURS = 20.0  # [1/s], our default
PRESETS = Path(studies.__path__[0]) / "flex" / "presets"


def flexible_entries(cases: Cases) -> list[Entry]:
    """The rows, in the order of the paper."""
    return [
        *element_entries(),
        *equation_entries(),
        *_stabilisation(),
        *_table_1(),
        *_figures(cases),
    ]


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


def _written_mass() -> Array:
    """M of (5) by quadrature of the shape functions, (8, 8)."""
    mass = np.zeros((8, 8))
    for xi, weight in zip(*gauss_legendre(6), strict=True):
        S = np.kron(_written_rows(xi), np.eye(2))
        mass += weight * L * ELEMENT.linear_density * S.T @ S
    return mass


def secant_stiffness(e: Array) -> Array:
    """K_l + K_n of (8)-(9), with quadrature far beyond what is needed; (8, 8)."""
    stiffness = np.zeros((8, 8))
    for xi, weight in zip(*gauss_legendre(8), strict=True):
        first, second = (np.kron(shape_row(xi, L, order), np.eye(2)) for order in (1, 2))
        square = first.T @ first
        bending = EI * second.T @ second
        stiffness += weight * L * (bending + EA / 2 * (e @ square @ e - 1) * square)
    return stiffness


def element_entries() -> list[Entry]:
    """Rows of the element, (1)-(10)."""
    e = _bent()
    xis = np.linspace(0.0, 1.0, 11)
    rows = max(float(np.abs(shape_row(xi, L) - _written_rows(xi)).max()) for xi in xis)

    # (1) at both nodes: the place and the slope that (3) says
    nodes = e.reshape(4, 2).T
    ends = [nodes @ shape_row(xi, L, order) for xi in (0.0, 1.0) for order in (0, 1)]

    mass = mass_matrix(L, ELEMENT.linear_density)
    energy, gradient, tangent = element_kernel()(e, EA, EI, L)
    secant = secant_stiffness(e)
    gap = apart(gradient.full().ravel(), secant @ e)
    lacking = float(np.linalg.norm(tangent.full() - secant) / np.linalg.norm(tangent.full()))
    return [
        exact("(2)-(3), Fig. 4: coordinates of an element", "8", len(mass)),
        formula("(1), (3): r = S e and its slope at both nodes", apart(np.concatenate(ends), e)),
        formula("(2): shape functions S1 to S4", rows),
        formula("(4)-(5): mass matrix, constant", apart(mass, _written_mass())),
        formula("(6)-(7): strain energy", abs(_energy(e) / float(energy) - 1)),
        formula("(8)-(9): elastic force K e, the gradient of (6)", gap),
        misprint(
            "(8): K as two derivatives of (6): share of the Hessian that K_l + K_n lacks",
            "0",
            lacking,
            "if the words mean the second derivative: (9) is the secant stiffness, and the Hessian "
            "has one term more, which Newton steps need",
            shown=gap < FORMULA,
        ),
        *_moment(e),
    ]


def _moment(e: Array) -> list[Entry]:
    """(10): work of a unit moment over a turn of the slope of the left and of the right node."""
    left, right = np.zeros(8), np.zeros(8)
    left[2:4], right[6:8] = (-e[3], e[2]), (-e[7], e[6])
    written = right / (right @ right)  # what is printed for the left node
    ours = np.zeros(8)
    ours[2:4] = moment_force(e[2], e[3], 1.0)
    return [
        misprint(
            "(10): work of a moment on the left node over a turn of its own slope",
            f"{written @ left:g}",
            float(ours @ left),
            "the force labelled 'left' acts on e7 and e8, the slope of the right node, and the "
            "other way round",
            shown=bool(abs(written @ right - 1.0) < EXACT),
        ),
        not_readable(
            "(10): entries of the vector of generalised forces",
            e.size,
            "seven in our copy of the text, for eight coordinates: a zero was lost in print or in "
            "the text recognition",
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


def equation_entries() -> list[Entry]:
    """(11)-(15) of an element whose pin is open, in any motion, under gravity."""
    chain = Chain((ELEMENT,), elements=1, gravity=GRAVITY)
    q, v = _bent(), np.linspace(-1.0, 2.0, 8)
    acceleration, multiplier = np.linspace(3.0, -4.0, 8), np.array([7.0, -5.0])
    alpha, beta = STABILISATIONS

    def solved(alpha: float, beta: float) -> Array:
        return Index1(chain, [Free()], alpha, beta).start(0.0, q, v)[0]

    # the terms as printed: the pin is Phi = r at the first node
    mass, elastic, jacobian = _written_mass(), secant_stiffness(q) @ q, np.eye(2, 8)
    load = sum(
        weight * L * ELEMENT.linear_density * np.kron(_written_rows(xi), GRAVITY)
        for xi, weight in zip(*gauss_legendre(6), strict=True)
    )
    matrix = np.block([[mass, jacobian.T], [jacobian, np.zeros((2, 2))]])

    def written(alpha: float, beta: float) -> Array:
        gamma = -2 * alpha * jacobian @ v - beta**2 * jacobian @ q
        return np.linalg.solve(matrix, np.concatenate((load - elastic, gamma)))

    form, zero = Index1(chain, [Free()]), np.zeros(1)
    axial = form.start(0.0, q, v)[1]

    def left_over(multiplier: Array) -> Array:
        unknowns = np.concatenate((acceleration, multiplier))
        columns = (part[:, None] for part in (q, v, unknowns, axial))
        return form.residual(zero, *columns)[0][:8, 0]

    balance = mass @ acceleration + elastic - load
    phi = form.constraints.value(zero, q[:, None])[:, 0]
    both = np.concatenate((left_over(multiplier), phi))
    release = single_pendulum(4)
    rest = posed(release)
    falls, _ = Index1(release, [Free()]).start(0.0, rest.q, rest.v)
    return [
        formula("(11): balance of forces, M a + K q - Q", apart(left_over(np.zeros(2)), balance)),
        formula(
            "(12): the same with a multiplier, and the constraint",
            apart(both, np.concatenate((balance + jacobian.T @ multiplier, jacobian @ q))),
        ),
        formula(
            "(13): accelerations and multipliers of a pinned element",
            apart(solved(0.0, 0.0), written(0.0, 0.0)),
            "of a pin, whose constraint is linear: the terms of its curvature and of time are zero",
        ),
        not_readable(
            "(13): first unknown at the release of the single pendulum, vertical, at its tip "
            "[m/s^2]",
            float(falls[release.slots(0, -1)[1]]),
            "one dot in our copy of the text, which is a velocity and zero there; the rows hold "
            "for the acceleration: a dot was lost in print or in the text recognition",
        ),
        formula(
            f"(14)-(15): accelerations with alpha = {alpha:g}/s, beta = {beta:g}/s",
            apart(solved(alpha, beta)[:8], written(alpha, beta)[:8]),
        ),
        assumption(
            "Algorithm 1: order of the method that integrates the motion",
            2 * StepControl().stages - 1,
            "the paper names no method, no step and no measure of convergence; ours is Radau IIA, "
            "and by default on coordinates that keep the constraints",
        ),
    ]


def _stabilisation() -> list[Entry]:
    """(14) on the double pendulum with its elbow locked, a constraint that drifts."""
    chain = double_pendulum(2)
    joints: list[Joint] = [Free(), Locked(0.0)]
    state, times = posed(chain), np.linspace(0.0, 0.5, 21)

    def drift(rate: float) -> float:
        """Largest violation [m or rad] by then, with alpha = beta = rate."""
        run = simulate(chain, joints, state, times, form="index-1", stabilisation=(rate, rate))
        return float(run.violation.max())

    bare = drift(0.0)
    found = [
        shape(
            f"(14): drift of a lock with alpha = beta = {rate:g}/s, over that without",
            (share := drift(rate) / bare),
            {f"the {end} factor stabilises": share < 0.5},
        )
        for rate, end in zip(STABILISATIONS, ("least", "greatest"), strict=True)
    ]
    return [
        *found,
        assumption(
            "(14): stability factors alpha and beta [1/s]",
            OURS,
            "the paper gives a range, 5 to 50; ours lie within, and are critical as alpha = beta",
        ),
    ]


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
            taken(f"Table 1: {title}, {column} pendulum [{unit}]", digits, value, reason)
            for title, unit, digits, value in rows
        ]

        gravity = -case["gravity"][1]
        found.append(taken(f"Table 1: gravity, {column} pendulum [m/s^2]", "9.81", gravity, reason))
    found.append(
        assumption(
            "Table 1: length of either link of the double pendulum [m]",
            links[0]["length"],
            "the paper prints one length, which we take as that of the chain, of two equal links",
        )
    )
    return found


def _figures(cases: Cases) -> list[Entry]:
    found = [
        assumption(
            "Fig. 5: angle at which both pendulums are released [deg]",
            0.0,
            "a drawing without numbers; ours start straight, horizontal and at rest",
        )
    ]
    for panel, name in (("a", "single"), ("b", "double")):
        run, coarse = cases.pendulums[name]
        tip, other = (motion.position(len(motion.chain.links) - 1) for motion in (run, coarse))
        drift = run.drift / float(run.kinetic.max())
        found.append(
            not_readable(
                f"Fig. 6({panel}): height of the {name} pendulum's tip at the end [m]",
                float(tip[1, -1]),
                "the paper compares ANCF with Abaqus, which is not repeated here; with half the "
                f"elements, our result differs by at most {np.abs(tip - other).max():.0e} m; the "
                f"energy drifts by {drift:.0e} of its kinetic part",
            )
        )
    return found
