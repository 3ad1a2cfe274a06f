"""Rows of section V-B: the flexible arm under the linear torque (Figs 15 and 16), and its sweeps.

The curves are drawn small and without numbers, and the paper gives no section of the arm. So what
can be held against ours are the statements of the text about them.

Symbols: T [s], tip and elbow [m], f frequency [Hz].
"""

from __future__ import annotations

import dataclasses

import numpy as np

from models.ancf.analysis import LockedRun, natural_modes
from models.ancf.chain import Link
from models.ancf.integrate import Simulation
from models.ancf.joints import Free, Locked
from models.ancf.state import posed
from models.arm.parameters import ASSUMED_DENSITY, ASSUMED_MODULUS, ArmParameters
from ocp.arrays import Array
from studies.arm.stage import ELBOW, ROOT, Stage, big_arm, small_arm
from studies.flex.measures import bending, fitted_frequency, vibration
from studies.paper.cases import ARM_STEPS, Cases
from studies.paper.entries import (
    Entry,
    assumption,
    not_readable,
    not_shared,
    shape,
    taken,
)

FOLDED = 2.178  # [Hz], of the arm with the small one folded and the root free
FIRST = 0.445  # [Hz], of the straight arm with both joints locked: where a fit begins
FASTER = {"big": (43.0, 21.5), "small": (56.0, 28.0)}  # [s], half and a quarter of the paper's
MODULI = (0.5, 2.0)  # multiples of Young's modulus
LENGTHS = (0.8, 1.0, 1.25)  # multiples of both arms' lengths
ARRIVED = 1e-3  # [rad] from the end angle
UNCHANGED = 5e-3  # relative change of a frequency that is none
QUIET = 1e-3  # of a motion's range: what a slight vibration stays below


def arm_entries(cases: Cases) -> list[Entry]:
    """The rows, in the order of the paper."""
    stages = {name: cases.arms[name] for name in ("big", "small")}
    return [
        *_lengths(),
        *_big(*stages["big"]),
        *_small(stages),
        *_sweeps(cases, stages),
    ]


def _lengths() -> list[Entry]:
    arm = ArmParameters()
    big, small = arm.big, arm.small
    unknown = (
        f"no section and no material are given; ours, of {ASSUMED_MODULUS / 1e9:g} GPa and "
        f"{ASSUMED_DENSITY:g} kg/m^3, is a tube of"
    )

    return [
        not_readable(
            "Fig. 1: supporting arms in the picture",
            len((big, small)),
            "a picture without numbers; of its parts the two arms and the truss with its ropes and "
            "net are modelled, the satellite holds the root",
        ),
        taken("V-B: length of both arms [m]", "5", big.length + small.length),
        taken("V-B: length of the big arm [m]", "3", big.length),
        taken("V-B: length of the small arm [m]", "2", small.length),
        *(
            assumption(
                f"V-B: bending stiffness of the {name} arm [N m^2]",
                link.bending_stiffness,
                f"{unknown} {tube}",
            )
            for name, link, tube in (("big", big, "60 x 2.0 mm"), ("small", small, "50 x 1.5 mm"))
        ),
        assumption(
            "V-A: mass of the antenna, a particle at the tip [kg]",
            arm.tip_mass,
            "the paper has a particle, too, but does not print its mass",
        ),
        assumption(
            "V-B: internal damping of the arm, over critical",
            arm.damping_ratio,
            "the paper names none",
        ),
        *(
            assumption(
                f"II-B, Fig. 2: {what} [deg]",
                abs(float(np.degrees(angle))),
                "not printed; our choice",
            )
            for what, angle in (
                ("turn of the big arm", big_arm().turn[ROOT]),
                ("turn of the small arm", small_arm().turn[ELBOW]),
                ("angle of the small arm to the big one while folded", big_arm().start[ELBOW]),
            )
        ),
    ]


def bent(run: Simulation, link: int) -> Array:
    """Displacement of a link's end across the tangent at its start, (m,) [m]."""
    return bending(run.chain, run.q, link)


def _big(stage: Stage, locked: LockedRun) -> list[Entry]:
    run = locked.before
    end, speed = run.position(0), _speed_along_x(run, 0)
    swing = shaken(run, 1)
    halves = [
        vibration(run.times[half], bent(run, 1)[half])
        for half in np.array_split(np.arange(len(run.times)), 2)
    ]
    span = float(np.ptp(run.position(0)[1]))
    miss = abs(locked.engagement.miss[ROOT])

    return [
        taken(
            "Fig. 15(a): time at which the big arm reaches its end [s]",
            "86",
            stage.duration,
            "our torque is made for it",
        ),
        shape(
            "Fig. 15(a): y of the big arm's end at 86 s [m]",
            float(end[1, -1]),
            {
                "in its ideal position, 3 m with the turn that we assume": abs(end[1, -1] - 3.0)
                < 1e-3,
                f"with an error of {miss:.1e} rad": miss < ARRIVED,
            },
        ),
        shape(
            "Fig. 15(b): maximum speed of the big arm's end along x [m/s]",
            float(np.abs(speed).max()),
            {"close to zero at the lock (V-A)": abs(speed[-1]) < 0.02 * np.abs(speed).max()},
        ),
        shape(
            "V-B: amplitude of the antenna's vibration during the big arm's motion [m]",
            swing,
            {
                "there is always a slight vibration": swing > 0,
                "it is minimal compared with the motion": swing < QUIET * span,
            },
        ),
        shape(
            "V-B: the big arm's motion: vibration in its second half over that in its first",
            halves[1] / halves[0],
            {"does not diminish; our arm has no damping": halves[1] > 0.95 * halves[0]},
        ),
    ]


def _speed_along_x(run: Simulation, link: int) -> Array:
    """Of a link's end, (m,) [m/s]."""
    return run.v[run.chain.slots(link, -1)[0]]


def shaken(run: Simulation, link: int) -> float:
    """Amplitude [m] of the vibration of a link's end, the greatest over tenths of the motion.

    Over a longer time the motion itself is no polynomial of the degree that is taken off.
    """
    pieces = np.array_split(np.arange(len(run.times)), 10)
    place = run.position(link)
    return max(vibration(run.times[i], along[i]) for i in pieces for along in place)


def _small(stages: dict[str, tuple[Stage, LockedRun]]) -> list[Entry]:
    (stage, locked), (_, big) = stages["small"], stages["big"]
    return [
        *_small_arm_end(stage, locked),
        *_while_turning(locked, big),
        *_after_its_lock(locked, big),
    ]


def _small_arm_end(stage: Stage, locked: LockedRun) -> list[Entry]:
    """Where and how fast the small arm's end moves until the lock."""
    run = locked.before
    tip, speed = run.position(1), _speed_along_x(run, 1)
    miss = abs(locked.engagement.miss[ELBOW])

    return [
        assumption(
            "Fig. 16(a): duration of the small arm's motion [s]",
            stage.duration,
            "printed as an approximate time, which we take from the release of the small arm; if "
            f"the clock started with the big arm, {stage.duration - 86:g} s would be left",
            printed="112",
        ),
        shape(
            "Fig. 16(a): y of the small arm's end at 112 s [m]",
            float(tip[1, -1]),
            {
                "in its position, 5 m with the turns that we assume": abs(tip[1, -1] - 5.0) < 1e-3,
                f"with an error of {miss:.1e} rad": miss < ARRIVED,
            },
        ),
        not_readable(
            "Fig. 16(b): maximum speed of the small arm's end along x [m/s]",
            float(np.abs(speed).max()),
            "the text mentions only the vibration",
        ),
        not_readable(
            "Fig. 16(c): maximum x of the small arm's end [m]",
            float(np.abs(tip[0]).max()),
            "the text mentions only the vibration",
        ),
    ]


def _while_turning(locked: LockedRun, big: LockedRun) -> list[Entry]:
    """What shakes while the small arm turns, its elbow free of all but the torque."""
    run = locked.before
    elbow, tip = run.position(0)[0], run.position(1)[0]
    drift, shaking = float(np.abs(elbow).max()), shaken(run, 0)

    # at half time, when the frequency hardly changes
    half = abs(run.times / run.times[-1] - 0.5) < 0.05
    tones = [fitted_frequency(run.times[half], along[half], 1.0) for along in (elbow, tip)]
    first = [_turning_frequency(angle) for angle in (180.0, 90.0)]

    return [
        not_shared(
            "V-B, Fig. 16(b): the antenna's vibration while the small arm turns over that "
            "while the big arm turns",
            "",
            (ratio := shaken(run, 1) / shaken(big.before, 1)),
            "described as more pronounced; ours is weaker as long as the elbow turns, and stronger "
            f"after its lock; the time steps damp modes above {ARM_STEPS['small'] / 5:g} Hz",
            shown=ratio < 0.5,
        ),
        not_shared(
            "V-B, Fig. 16(b): first natural frequency while the small arm turns, folded [Hz]",
            "",
            first[0],
            f"described as much below the {FOLDED:g} Hz of the big arm's motion; ours is so only "
            f"in the middle of the turn, {first[1]:.3f} Hz, and after the lock",
            shown=first[1] < FOLDED / 2 and first[0] > FOLDED,
        ),
        shape(
            "Fig. 16(d): drift of the big arm's end along x while the small arm turns [m]",
            drift,
            {
                "there is a continuous drift, far above the vibration": drift > 10 * shaking,
                "by the reaction: it changes sign with the torque": bool(
                    elbow.max() > 0 > elbow.min()
                ),
            },
        ),
        shape(
            "Fig. 16(d): frequency of the big arm's end over that of the tip, at half of the turn",
            tones[0] / tones[1],
            {"the two are consistent": abs(tones[0] / tones[1] - 1) < UNCHANGED},
        ),
    ]


def _turning_frequency(elbow_deg: float) -> float:
    """First natural frequency [Hz] with the big arm locked and the elbow free at an angle."""
    chain = ArmParameters().chain(8)
    state = posed(chain, [0.0, np.radians(elbow_deg)])
    modes = natural_modes(chain, [Locked(0.0), Free()], state, count=1)
    return float(modes.frequencies[0])


def _after_its_lock(locked: LockedRun, big: LockedRun) -> list[Entry]:
    """How the whole arm swings once the small one is locked, too.

    Parameters
    ----------
    locked, big : the motions of the small and of the big arm.
    """
    after = locked.after
    assert after is not None  # asked for
    assert big.after is not None

    swings = [float(np.ptp(motion.position(1)[0])) / 2 for motion in (after, big.after)]
    first = fitted_frequency(after.times, bent(after, 0), FIRST)
    fluctuation = float(np.ptp(after.position(0)[0])) / 2 / shaken(locked.before, 0)

    return [
        shape(
            "V-B: amplitude of the tip after the lock of the small arm over that of the big arm",
            swings[0] / swings[1],
            {"significantly increased, if the lock is meant": swings[0] > 2 * swings[1]},
        ),
        shape(
            "V-B: frequency after the lock of the small arm [Hz]",
            first,
            {
                f"significantly reduced from the {FOLDED:g} Hz of the big arm, if the lock is "
                "meant": first < FOLDED / 2
            },
        ),
        shape(
            "V-B: vibration of the big arm's end after the lock over that before it",
            fluctuation,
            {"greater after the lock than during the motion": fluctuation > 1},
        ),
    ]


def _sweeps(cases: Cases, stages: dict[str, tuple[Stage, LockedRun]]) -> list[Entry]:
    """What changes with the time of a motion, the modulus and the length."""
    runs = {
        name: [stages[name], *(cases.faster(name, T) for T in FASTER[name])]
        for name in ("big", "small")
    }
    return [
        *(_energy_left(name, paces) for name, paces in runs.items()),
        *_vibration_by_pace([locked.before for _, locked in runs["big"]]),
        _modulus(cases, stages["big"][1]),
        _length(),
    ]


def _energy_left(name: str, runs: list[tuple[Stage, LockedRun]]) -> Entry:
    paces = [stage.duration for stage, _ in runs]
    energies = [locked.residual_energy for _, locked in runs]
    return shape(
        f"V-B: energy that the lock of the {name} arm leaves in {paces[-1]:g} s over that "
        f"in {paces[0]:g} s",
        energies[-1] / energies[0],
        {"less energy after a longer time": _falls(energies[::-1])},
    )


def _vibration_by_pace(runs: list[Simulation]) -> list[Entry]:
    """Amplitude and frequency of the big arm's vibration, the slowest motion first."""
    histories = [(run.times, bent(run, 1)) for run in runs]
    swings = [vibration(*history) for history in histories]
    tones = [fitted_frequency(*history, FOLDED) for history in histories]
    paces = f"in {FASTER['big'][-1]:g} s over that in 86 s"

    return [
        shape(
            f"V-B: amplitude of the vibration {paces}",
            swings[-1] / swings[0],
            {"it increases with the speed of rotation": _falls(swings[::-1])},
        ),
        not_shared(
            f"V-B, VI: frequency of the vibration {paces}",
            "",
            tones[-1] / tones[0],
            f"described as increasing with the speed; ours stays at {tones[0]:.4f} Hz and "
            f"{tones[-1]:.4f} Hz, since the turn is slow compared with the vibration",
            shown=abs(tones[-1] / tones[0] - 1) < UNCHANGED,
        ),
    ]


def _falls(values: list[float]) -> bool:
    return bool((np.diff(values) < 0).all())


def _modulus(cases: Cases, nominal: LockedRun) -> Entry:
    soft, stiff = (cases.faster("big", 86.0, modulus)[1] for modulus in MODULI)
    runs = (soft, nominal, stiff)
    deflections = [float(np.abs(bent(run.before, 1)).max()) for run in runs]
    swings = [vibration(run.before.times, bent(run.before, 1)) for run in runs]
    return shape(
        f"V-B: amplitude of the vibration with {MODULI[1]:g} times the modulus over "
        f"{MODULI[0]:g} times",
        swings[-1] / swings[0],
        {
            "a larger modulus reduces the deformation": _falls(deflections),
            "and the amplitude of the vibration": _falls(swings),
        },
    )


def _length() -> Entry:
    tones = [float(_first_frequency(factor)) for factor in LENGTHS]
    return shape(
        f"VI: first frequency of the straight locked arm, {LENGTHS[-1]:g} times as long, over ours",
        tones[-1] / tones[1],
        {"it decreases with the arm's length": _falls(tones)},
    )


def _first_frequency(factor: float) -> float:
    """First natural frequency [Hz] of the straight, locked arm with both lengths multiplied."""
    arm = ArmParameters()

    def longer(link: Link) -> Link:
        return dataclasses.replace(link, length=factor * link.length)

    chain = dataclasses.replace(arm, big=longer(arm.big), small=longer(arm.small)).chain(8)
    return float(natural_modes(chain, [Locked(0.0)] * 2, posed(chain), count=1).frequencies[0])
