"""Rows of section V-C: energies, motor force and tensions of the deploying truss (Figs 17 to 20).

Symbols: mu pulley friction, T1 motor force on one rope [N], U potential energy [J].
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import casadi as ca
import numpy as np

from models.truss import (
    DYNAMIC_SET,
    least_peak_reaction,
    potential_slope,
    rope_leverage,
    static_force,
    tension_ratios,
)
from models.truss.parameters import TUBE_DENSITY, TUBE_INNER_DIAMETER, TUBE_OUTER_DIAMETER
from ocp.arrays import Array
from studies.paper.cases import DEPLOYED, FRICTIONS, WITH_FRICTION, Cases
from studies.paper.entries import Entry, assumption, exact, misprint, not_shared, shape, taken
from studies.paper.sections.truss_model import spring_force
from studies.truss.motions.deployment import Deployment

SAMPLES = 20_001
BALANCE = 1e-8  # of the motor's work
SMALL = 0.05  # share of the motor's work that counts as very small


def dynamics_entries(cases: Cases) -> list[Entry]:
    """The rows, in the order of the paper."""
    return [
        *parameter_entries(),
        _density(cases),
        *_energies(cases),
        *_forces(cases),
        *_tensions(cases),
    ]


def parameter_entries() -> list[Entry]:
    """The parameters of the dynamic set."""
    truss = DYNAMIC_SET
    area = math.pi / 4 * (TUBE_OUTER_DIAMETER**2 - TUBE_INNER_DIAMETER**2)

    def used(what: str, printed: str, ours: float) -> Entry:
        return taken(f"V-C: {what}", printed, ours, "the value of our dynamic set")

    return [
        used("length a of a vertical bar [m]", "1", truss.bar_length),
        used("half cross-bar b, dynamic set [m]", "0.45", truss.half_cross_bar),
        used("crank c [m]", "0.1", truss.crank),
        used("link d [m]", "0.15", truss.link),
        used("number n of modules", "24", truss.modules),
        taken(
            "V-C: density of the bars [kg/m^3]",
            "1800",
            TUBE_DENSITY,
            "called a linear density, but with the unit of a density",
        ),
        assumption(
            "V-C: section of the bars [mm^2]",
            1e6 * area,
            f"tubes of {1e3 * TUBE_OUTER_DIAMETER:g} mm outer and {1e3 * TUBE_INNER_DIAMETER:g} mm "
            f"inner diameter at {TUBE_DENSITY:g} kg/m^3; the paper gives no section",
        ),
        assumption(
            "(23): concentrated mass of each joint [kg]",
            truss.joint_masses.bar_end,
            "the paper gives no joint masses; ours are zero",
        ),
        used("initial deployment angle [deg]", "4.4", math.degrees(truss.stowed_angle)),
        used("critical angle of the net [deg]", "80", math.degrees(truss.net_angle)),
        used("stiffness k1 of the compression springs [N/m]", "100", truss.spring_stiffness),
        used("equivalent stiffness k2 of the net [N/m]", "200", truss.net_stiffness),
        used("natural length l0 of the springs [m]", "0.3", truss.spring_free_length),
        used("viscous friction xi1 of rotating joints [N m s/rad]", "0.1", truss.joint_friction),
        used("viscous friction xi2 of sliding joints [N s/m]", "0.1", truss.slider_friction),
    ]


def _density(cases: Cases) -> Entry:
    """What the printed density would do as a linear one."""
    heavy = dataclasses.replace(DYNAMIC_SET, linear_density=TUBE_DENSITY)
    share, ours = (
        100 * _shares(deployment)["kinetic"]
        for deployment in (cases.laws(heavy)[0], cases.dynamic[0])
    )
    return misprint(
        "V-C: maximum kinetic energy over the motor's work, if 1800 is a linear density [%]",
        f"{share:.3g}",
        ours,
        "described as very small, as it is if 1800 kg/m^3 is the density of our tubes",
        shown=share > 100 > 100 * SMALL > ours,
    )


def _shares(deployment: Deployment) -> dict[str, float]:
    """Energies over the motor's work: peak of the kinetic one, ends of the others."""
    energies = deployment.energies
    work = float(energies.motor[-1])
    return {
        "work": work,
        "kinetic": float(np.abs(energies.kinetic).max()) / work,
        "joints": float(energies.joints[-1]) / work,
        "pulleys": float(energies.pulleys[-1]) / work,
        "potential": float(energies.potential[-1]) / work,
        "imbalance": energies.imbalance,
    }


def _energies(cases: Cases) -> list[Entry]:
    smooth, rubbing = cases.dynamic[0], cases.rubbing[0]
    plain, lossy = _shares(smooth), _shares(rubbing)
    return [
        *_without_friction(smooth, plain),
        *_with_friction(rubbing, plain, lossy),
        *_concluded(plain, lossy),
        _reaction(cases),
    ]


def _without_friction(deployment: Deployment, plain: Mapping[str, float]) -> list[Entry]:
    """Fig. 17: the work becomes potential energy."""
    small = [
        shape(
            f"Fig. 17(a): {words} over the motor's work, mu = 0 [%]",
            100 * plain[key],
            {"very small": plain[key] < SMALL},
        )
        for key, words in (
            ("kinetic", "maximum kinetic energy"),
            ("joints", "dissipated in the joints"),
        )
    ]

    return [
        taken("V-C: pulley friction of Fig. 17", "0", deployment.truss.pulley_friction),
        *small,
        shape(
            "Fig. 17(b): potential energy gained over the motor's work, mu = 0 [%]",
            100 * plain["potential"],
            {
                "the work becomes mainly potential energy": plain["potential"] > 1 - 2 * SMALL,
                "the energies add up to the work": plain["imbalance"] < BALANCE,
            },
        ),
    ]


def _with_friction(
    deployment: Deployment, plain: Mapping[str, float], lossy: Mapping[str, float]
) -> list[Entry]:
    """Fig. 18: what does not become potential energy becomes heat."""
    rest = 1.0 - lossy["potential"]

    return [
        taken("V-C: pulley friction of Fig. 18", "0.01", WITH_FRICTION.pulley_friction),
        misprint(
            "Fig. 18: pulley friction in the caption",
            "0",
            deployment.truss.pulley_friction,
            "the text says 0.01, and without friction the dissipation that the figure draws in "
            "the pulleys would be zero",
            shown=plain["pulleys"] == 0.0 < lossy["pulleys"],
        ),
        shape(
            "Fig. 18(a): maximum kinetic energy over the motor's work, mu = 0.01 [%]",
            100 * lossy["kinetic"],
            {"kinetic energy very small": lossy["kinetic"] < SMALL},
        ),
        shape(
            "Fig. 18(b): dissipated in the pulleys over the motor's work, mu = 0.01 [%]",
            100 * lossy["pulleys"],
            {
                "the rest of the work": abs(rest - lossy["pulleys"] - lossy["joints"]) < 1e-6,
                "the energies add up to the work": lossy["imbalance"] < BALANCE,
            },
        ),
    ]


def _concluded(plain: Mapping[str, float], lossy: Mapping[str, float]) -> list[Entry]:
    """What section VI says of the energies."""
    heat, rest = lossy["pulleys"] + lossy["joints"], 1.0 - lossy["potential"]

    return [
        shape(
            "VI: heat over the work without the potential energy, mu = 0.01 [%]",
            100 * heat / rest,
            {"most of the rest becomes heat": heat > 0.99 * rest},
        ),
        assumption(
            "VI: how many of the two topics for future work the models have",
            0,
            "flexible members and play in the joints: ours are rigid and have none, as the paper's",
            printed="2",
        ),
        not_shared(
            "VI: potential energy gained over the motor's work, mu = 0.01 [%]",
            "",
            100 * lossy["potential"],
            f"described as the main share: this holds without pulley friction "
            f"({100 * plain['potential']:.1f} %), but with the paper's 0.01 the pulleys take "
            f"{100 * lossy['pulleys']:.1f} %",
            shown=lossy["potential"] < lossy["pulleys"],
        ),
    ]


def _reaction(cases: Cases) -> Entry:
    """What section VI says of the force on the arm."""
    bezier, step5 = (deployment.values["peak-reaction"] for deployment in cases.dynamic)
    least = least_peak_reaction(DYNAMIC_SET, cases.study.duration)
    return shape(
        "VI: peak reaction on the arm, Bezier over Step5",
        bezier / step5,
        {
            "lower, for the two laws compared": bezier < step5,
            f"not the minimum: {bezier:.2e} N, of which {least:.2e} N cannot be avoided": least
            < bezier,
        },
    )


def _forces(cases: Cases) -> list[Entry]:
    found = []
    for mu in FRICTIONS:
        truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=mu)
        found += force_entries(cases.laws(truss)[0])

    # what the net alone asks of the rope near the singular point
    angles = np.array([math.radians(85.0), DEPLOYED])
    net = [_net_force(angle) for angle in angles]
    drawn = [mu for mu in FRICTIONS if mu not in (0.0, WITH_FRICTION.pulley_friction)]
    return [
        assumption(
            "Fig. 19: frictions between 0 and 0.01 that are drawn",
            len(drawn),
            f"the paper's own cannot be read; ours are {' and '.join(f'{mu:g}' for mu in drawn)}",
        ),
        *found,
        shape(
            "V-C: motor force that the net alone needs when fully deployed [N]",
            net[1],
            {f"carried by the truss, compared with {net[0]:.1f} N at 85 deg": abs(net[1]) < 1e-9},
        ),
    ]


def _net_force(angle: float) -> float:
    """Motor force on each rope that holds the net without springs and friction [N]."""
    bare = dataclasses.replace(DYNAMIC_SET, spring_stiffness=0.0)
    slope, leverage = (float(f(bare, ca.DM(angle))) for f in (potential_slope, rope_leverage))
    return slope / leverage


def force_entries(deployment: Deployment) -> list[Entry]:
    """Start, peak and end of the Bezier law's motor force, and the way between them."""
    truss, T = deployment.truss, deployment.law.duration
    mu = f"mu = {truss.pulley_friction:g}"
    t = np.linspace(0.0, T, SAMPLES)
    motion, history = deployment.at(t)
    force = history.rope_force

    peak = deployment.extremes["peak-force"]
    at_peak = math.degrees(float(deployment.law.motion(peak.time).angle[0]))
    before, after = t < peak.time, t > peak.time
    start, end = (float(static_force(truss, ca.DM(a))) for a in (truss.stowed_angle, DEPLOYED))
    rest = {"the spring's force": _close(force[0], start), "some tension": force[0] > 0}
    held = {"the spring's force": _close(force[-1], end)}
    if truss.pulley_friction == 0.0:
        rest["by hand: half of k1 (l0 - e)"] = _close(start, spring_force(truss, motion.angle[0]))
        held["by hand: half of k1 (l0 - e)"] = _close(end, spring_force(truss, DEPLOYED))

    taut = motion.angle >= truss.net_angle
    rate = np.gradient(force, t)
    # in a fast motion the peak comes before the net is taut
    slack_rate, taut_rate = (
        float(rate[before & part].max(initial=-math.inf)) for part in (~taut, taut)
    )
    return [
        shape(f"Fig. 19: motor force at the start, {mu} [N]", float(force[0]), rest),
        shape(
            f"Fig. 19: maximum motor force, {mu} [N]",
            peak.value,
            {
                "rises monotonically to it": _rises(force[before]),
                "faster once the net is taut": taut_rate > slack_rate,
                f"peak before 90 deg, at {at_peak:.1f} deg": truss.net_angle
                < math.radians(at_peak)
                < DEPLOYED,
                "falls from it to the end": _rises(-force[after]),
            },
        ),
        shape(f"Fig. 19: motor force at the end, {mu} [N]", float(force[-1]), held),
    ]


def _close(value: float, wanted: float) -> bool:
    return bool(abs(value - wanted) < 1e-6 * abs(wanted))


def _rises(values: Array) -> bool:
    return bool((np.diff(values) > -1e-9 * np.abs(values).max()).all())


def _tensions(cases: Cases) -> list[Entry]:
    deployment = cases.rubbing[0]
    truss, T = deployment.truss, deployment.law.duration

    # segment k bears T1 times a ratio that depends on the angle alone
    moments = np.array([0.0, T / 2, deployment.extremes["peak-force"].time, T])
    motion, history = deployment.at(moments)
    profiles = np.array(
        [
            force * ca.DM(tension_ratios(truss, float(angle))).full().ravel()
            for angle, force in zip(motion.angle, history.rope_force, strict=True)
        ]
    )
    falls = bool((np.diff(profiles, axis=1) <= 1e-12).all())
    farthest = bool(
        (profiles.argmin(axis=1) == profiles.shape[1] - 1).all()
        or np.allclose(profiles.min(axis=1), profiles[:, -1])
    )
    last_of_first = profiles[:, -1] / profiles[:, 0]

    return [
        exact("V-C: cable sections of a rope", "96", profiles.shape[1]),
        shape(
            "Fig. 20: tension of the last segment over the motor's at the start, mu = 0.01",
            float(last_of_first[0]),
            {
                "the tension decreases along the rope at all times": falls,
                "the segment farthest from the motor has the minimum": farthest,
                "the decrease depends on the angle": float(np.ptp(last_of_first)) > 0.1,
            },
        ),
    ]
