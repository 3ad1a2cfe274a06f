"""Rows of section V-B: the flexible arm under the linear torque (Figs 15 and 16), and its sweeps.

The curves are drawn small and without numbers, and the paper gives no section of the arm. So what
can be held against ours are the statements of the text about them.

Symbols: T [s], tip and elbow [m], f frequency [Hz].
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from models.ancf.analysis import LockedRun, natural_modes
from models.ancf.chain import Link
from models.ancf.integrate import Simulation
from models.ancf.joints import Locked, joint_rates
from models.ancf.state import posed
from models.arm.parameters import ArmParameters
from ocp.arrays import Array
from studies.arm.stage import ELBOW, ROOT, Stage
from studies.flex.measures import bending, fitted_frequency, vibration
from studies.paper.cases import Cases
from studies.paper.entries import Entry, assumption, equal, given, misprint, not_readable, shape

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
    unknown = "no section and no material are given; ours is a CFRP tube of"

    return [
        not_readable(
            "Fig. 1",
            "supporting arms in the picture",
            "1",
            len((big, small)),
            "a picture without numbers; of its parts the two arms and the truss with its ropes and "
            "net are modelled, the satellite holds the root",
        ),
        given("V-B", "length of both arms", "m", "5", big.length + small.length),
        given("V-B", "length of the big arm", "m", "3", big.length),
        given("V-B", "length of the small arm", "m", "2", small.length),
        *(
            assumption(
                "V-B",
                f"bending stiffness of the {name} arm",
                "N m^2",
                link.bending_stiffness,
                f"{unknown} {tube}",
            )
            for name, link, tube in (("big", big, "60 x 2.0 mm"), ("small", small, "50 x 1.5 mm"))
        ),
        assumption(
            "V-A",
            "mass of the antenna, a particle at the tip",
            "kg",
            arm.tip_mass,
            "the paper has a particle, too, but does not print its mass",
        ),
    ]


def bent(run: Simulation, link: int) -> Array:
    """Displacement of a link's end across the tangent at its start, (m,) [m]."""
    return bending(run.chain, run.q, link)


def _arrival(run: Simulation, joint: int) -> float:
    """When a joint has turned to its end and stands still for the first time [s]."""
    rate = joint_rates(run.chain, run.q, run.v)[joint]
    half = len(run.times) // 2
    forward = rate * np.sign(rate[half])
    still = np.flatnonzero(forward[half:] <= 1e-6 * forward.max())
    return float(run.times[half + still[0]]) if still.size else float(run.times[-1])


def _big(stage: Stage, locked: LockedRun) -> list[Entry]:
    run = locked.before
    end, speed = run.position(0), _speed_along_x(run, 0)
    swing = vibration(run.times, bent(run, 1))
    span = float(np.ptp(run.position(0)[1]))
    miss = abs(locked.engagement.miss[ROOT])

    return [
        equal(
            "Fig. 15(a)",
            "time at which the big arm stands at its end",
            "s",
            "86",
            _arrival(run, ROOT),
            f"the torque is made for it; the flexible arm is then {miss:.1e} rad off",
        ),
        shape(
            "Fig. 15(a)",
            "y of the big arm's end at 86 s",
            "m",
            float(end[1, -1]),
            {
                "starts at 0": abs(end[1, 0]) < 1e-9,
                "rises monotonically": bool((np.diff(end[1]) > -1e-6).all()),
                "ends in its ideal position, at 3 m": abs(end[1, -1] - 3.0) < 1e-3,
                "arrives without a miss": miss < ARRIVED,
            },
        ),
        _greatest_speed("Fig. 15(b)", "big", speed, {"one hump of one sign": _one_hump(speed)}),
        shape(
            "V-B",
            "amplitude of the antenna's vibration during the big arm's motion",
            "m",
            swing,
            {
                "there is always a slight vibration": swing > 0,
                "it is minimal beside the motion": swing < QUIET * span,
            },
        ),
    ]


def _one_hump(history: Array) -> bool:
    """Whether a history keeps its sign, but for its vibration."""
    peak = history[np.abs(history).argmax()]
    return bool((history * np.sign(peak) > -0.02 * abs(peak)).all())


def _speed_along_x(run: Simulation, link: int) -> Array:
    """Of a link's end, (m,) [m/s]."""
    return run.v[run.chain.slots(link, -1)[0]]


def _greatest_speed(place: str, name: str, speed: Array, between: Mapping[str, bool]) -> Entry:
    """The speed of an arm's end, with what it does between rest and rest."""
    greatest = float(np.abs(speed).max())
    return shape(
        place,
        f"greatest speed of the {name} arm's end along x",
        "m/s",
        greatest,
        {
            "starts at rest": abs(speed[0]) < 1e-9,
            **between,
            "ends close to rest": abs(speed[-1]) < 0.02 * greatest,
        },
    )


def _small(stages: dict[str, tuple[Stage, LockedRun]]) -> list[Entry]:
    locked, big = stages["small"][1], stages["big"][1]
    elbow = locked.before.position(0)
    shaking = vibration(locked.before.times, elbow[0])
    return [
        *_small_arm_end(locked),
        _reaction(elbow, shaking),
        *_after_its_lock(locked, big, shaking),
    ]


def _small_arm_end(locked: LockedRun) -> list[Entry]:
    """Where and how fast the small arm's end moves until the lock."""
    run = locked.before
    tip, speed = run.position(1), _speed_along_x(run, 1)
    miss = abs(locked.engagement.miss[ELBOW])

    return [
        equal(
            "Fig. 16(a)",
            "time at which the small arm stands at its end",
            "s",
            "112",
            _arrival(run, ELBOW),
            f"printed as approximate; the flexible arm is then {miss:.1e} rad off",
        ),
        shape(
            "Fig. 16(a)",
            "y of the small arm's end at 112 s",
            "m",
            float(tip[1, -1]),
            {
                "starts folded, at 1 m": abs(tip[1, 0] - 1.0) < 1e-9,
                "rises monotonically": bool((np.diff(tip[1]) > -1e-6).all()),
                "ends straight, at 5 m": abs(tip[1, -1] - 5.0) < 1e-3,
                "arrives without a miss": miss < ARRIVED,
            },
        ),
        _greatest_speed(
            "Fig. 16(b)",
            "small",
            speed,
            {"out and back: both signs": bool(speed.max() > 0 > speed.min())},
        ),
        shape(
            "Fig. 16(c)",
            "greatest x of the small arm's end",
            "m",
            float(np.abs(tip[0]).max()),
            {
                "out to the arm's length": abs(np.abs(tip[0]).max() - 2.0) < 1e-3,
                "and back": abs(tip[0, -1]) < 1e-3,
            },
        ),
    ]


def _reaction(elbow: Array, shaking: float) -> Entry:
    """What the turning small arm does to the end of the big one, which is locked."""
    drift = float(np.abs(elbow[0]).max())
    both_signs = bool(elbow[0].max() > 0 > elbow[0].min())
    return shape(
        "Fig. 16(d)",
        "drift of the big arm's end along x while the small arm turns",
        "m",
        drift,
        {
            "there is a continuous drift, slow beside the vibration": drift > 10 * shaking,
            "by the reaction: it changes sign with the torque": both_signs,
        },
    )


def _after_its_lock(locked: LockedRun, big: LockedRun, shaking: float) -> list[Entry]:
    """How the whole arm swings once the small one is locked, too.

    Parameters
    ----------
    locked, big : the motions of the small and of the big arm.
    shaking : amplitude of the big arm's end while the small one turns [m].
    """
    after = locked.after
    assert after is not None  # asked for
    assert big.after is not None

    swings = [float(np.ptp(motion.position(1)[0])) / 2 for motion in (after, big.after)]
    fluctuation = float(np.ptp(after.position(0)[0])) / 2
    first = fitted_frequency(after.times, bent(after, 0), FIRST)
    ratio = first / fitted_frequency(after.times, after.position(1)[0], FIRST)

    return [
        shape(
            "V-B",
            "amplitude of the tip after the lock of the small arm over that of the big arm",
            "1",
            swings[0] / swings[1],
            {"significantly increased": swings[0] > 2 * swings[1]},
        ),
        shape(
            "V-B",
            "frequency after the lock of the small arm",
            "Hz",
            first,
            {f"significantly reduced from the {FOLDED:g} Hz of the big arm": first < FOLDED / 2},
        ),
        shape(
            "V-B",
            "vibration of the big arm's end after the lock over that before it",
            "1",
            fluctuation / shaking,
            {"greater after the lock than during the motion": fluctuation > shaking},
        ),
        shape(
            "Fig. 16(d)",
            "frequency of the big arm's end over that of the tip, after the lock",
            "1",
            ratio,
            {"the two are consistent": abs(ratio - 1) < UNCHANGED},
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
        "V-B",
        f"energy that the lock of the {name} arm leaves in {paces[-1]:g} s over that in "
        f"{paces[0]:g} s",
        "1",
        energies[-1] / energies[0],
        {"a longer time leaves less": _falls(energies[::-1])},
    )


def _vibration_by_pace(runs: list[Simulation]) -> list[Entry]:
    """Amplitude and frequency of the big arm's vibration, the slowest motion first."""
    histories = [(run.times, bent(run, 1)) for run in runs]
    swings = [vibration(*history) for history in histories]
    tones = [fitted_frequency(*history, FOLDED) for history in histories]
    paces = f"in {FASTER['big'][-1]:g} s over that in 86 s"

    return [
        shape(
            "V-B",
            f"amplitude of the vibration {paces}",
            "1",
            swings[-1] / swings[0],
            {"it increases with the speed of rotation": _falls(swings[::-1])},
        ),
        misprint(
            "V-B, VI",
            f"frequency of the vibration {paces}",
            "1",
            "",
            tones[-1] / tones[0],
            f"said to increase with the speed; ours stays at {tones[0]:.4f} Hz and "
            f"{tones[-1]:.4f} Hz, since the turning is slow beside the vibration",
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
        "V-B",
        f"amplitude of the vibration with {MODULI[1]:g} times the modulus over {MODULI[0]:g} times",
        "1",
        swings[-1] / swings[0],
        {
            "a larger modulus reduces the deformation": _falls(deflections),
            "and the amplitude of the vibration": _falls(swings),
        },
    )


def _length() -> Entry:
    tones = [float(_first_frequency(factor)) for factor in LENGTHS]
    return shape(
        "VI",
        f"first frequency of the straight locked arm, {LENGTHS[-1]:g} times as long, over ours",
        "1",
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
