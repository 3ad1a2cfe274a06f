"""A small torque added to an optimum, so that the full model and not B21 comes to rest at the lock.

The full model replays the optimal torque and ends a little beside rest, in modes that B21 has at
other frequencies or lacks. About the end pose each mode is an oscillator, whose end follows from
the torque by an integral. The least torque that takes the deviation away is a sum of the modes'
responses. The arm's pose changes on the way, so that the replay tells what is left, and the same is
done again.

Symbols: y modal coordinates and their rates at the lock (2 k,); g their responses to a unit
impulse of torque at time t; w weight over time; M mass matrix; T time of the lock [s].
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, PPoly

from models.ancf.analysis import natural_modes
from models.ancf.assembly import dense
from models.ancf.chain import Chain
from models.ancf.integrate import Simulation
from models.ancf.joints import Free, joint_rates
from models.ancf.motion import MinimalCoordinates
from models.ancf.state import posed
from ocp.arrays import Array
from studies.arm.replay.satellite import across
from studies.arm.stage import ROOT, Stage

FASTEST = (20.0, 45.0)  # [Hz], up to which modes are corrected, where the elbow turns, the root
_SHARES = (0.25, 0.75)  # of the stage that the correction may last, likewise
_COUNT = 6  # modes looked at, or as many as the mesh resolves
_POSES = 17  # on the way, at which the modes are found
_A_PERIOD = 24  # points of the correction in a period of the fastest mode
_TURN = 1e-6  # [rad] of the difference quotient that gives the rigid motion


@dataclass(frozen=True, eq=False)
class _Modes:
    """Bending modes of a pose with the joint free, the rigid motion first.

    Attributes
    ----------
    omega : (k,) angular frequencies [rad/s].
    shapes : (size, k) of unit modal mass, so signed that they open the joint.
    gain : (k,) turn of the joint in each, which a torque drives [rad/(m sqrt(kg))].
    """

    omega: Array
    shapes: Array
    gain: Array


def correction(stage: Stage, run: Simulation) -> dict[int, PPoly]:
    """The torque [N m] to be added at the joint that turns.

    Zero with its slope at both ends, so that the torque keeps starting and ending with none.

    Parameters
    ----------
    stage : Stage
        With one joint that turns.
    run : Simulation
        Of the full model under the torque so far, until the lock.
    """
    joint, end = stage.moving[0], stage.duration
    share, fastest = _SHARES[joint == ROOT], FASTEST[joint == ROOT]
    last = _modes(stage, run.chain, joint, stage.end[joint])
    count = int((last.omega <= 2 * np.pi * fastest).sum())
    y = _deviation(stage, run, last.shapes[:, :count])

    points = int(np.ceil(share * end * last.omega[count - 1] / (2 * np.pi) * _A_PERIOD))
    t = np.linspace((1.0 - share) * end, end, max(points, 101))
    s = (t - t[0]) / (end - t[0])
    w = (s * (1.0 - s)) ** 2

    # least integral of torque^2 / w that brings -y: tau = w g c with (int g w g^T) c = -y
    g = _responses(stage, run, t, count)
    gram = np.trapezoid(g[:, None] * g[None] * w, t, axis=-1)
    sizes = np.sqrt(np.diag(gram))
    c = np.linalg.solve(gram / np.outer(sizes, sizes), -y / sizes) / sizes

    added = CubicSpline(t, w * (c @ g), bc_type="clamped")
    return {joint: _from_zero(PPoly(added.c, added.x))}


def with_added(law: PPoly, more: PPoly) -> PPoly:
    """The sum of two piecewise polynomials over the span of the first."""
    x = np.union1d(law.x, more.x[(more.x > law.x[0]) & (more.x < law.x[-1])])
    order = max(len(law.c), len(more.c))
    starts, factorial, coefficients = x[:-1], 1.0, []
    for k in range(order):
        factorial *= max(k, 1)
        coefficients.append((law(starts, k) + more(starts, k)) / factorial)
    return PPoly(np.array(coefficients[::-1]), x)


def added_to(laws: Mapping[int, PPoly], more: Mapping[int, PPoly]) -> dict[int, PPoly]:
    """Torque laws by joint, with corrections added where there are any."""
    return {k: with_added(law, more[k]) if k in more else law for k, law in laws.items()}


def _modes(stage: Stage, chain: Chain, joint: int, angle: float) -> _Modes:
    """Modes of the undeformed arm with the joint free at an angle [rad]."""
    angles = [angle if k == joint else a for k, a in enumerate(stage.end)]
    rest = posed(chain, angles)
    joints = stage.full_joints({joint: Free()})
    elastic = natural_modes(chain, joints, rest, count=_COUNT, resolved=True)
    bending = elastic.axial_fraction < 0.5  # a torque at the joint does not stretch straight links

    turned = [
        posed(chain, [a + side * (k == joint) for k, a in enumerate(angles)]).q
        for side in (-_TURN, _TURN)
    ]
    rigid = (turned[1] - turned[0]) / (2 * _TURN)
    assembly = MinimalCoordinates(chain, [Free()] * len(chain.links)).assembly
    x, mass = assembly.gather(rigid), dense(assembly.mass)
    if stage.carried:
        # the satellite turns against the joint, so that both have no momentum
        whole = across(rest.q[:, None])[:, 0]
        y = assembly.gather(whole)
        rigid -= whole * (y @ mass @ x) / (y @ mass @ y)
        x = assembly.gather(rigid)
    rigid /= np.sqrt(x @ mass @ x)

    omega = np.concatenate([[0.0], 2 * np.pi * elastic.frequencies[bending]])
    shapes = np.column_stack([rigid, elastic.shapes[:, bending]])
    gain = np.array([joint_rates(chain, rest.q[:, None], x[:, None])[joint, 0] for x in shapes.T])
    return _Modes(omega, shapes * np.sign(gain), np.abs(gain))


def _deviation(stage: Stage, run: Simulation, shapes: Array) -> Array:
    """Y (2 k,): modal coordinates of the end beside rest, then their rates."""
    rest = posed(run.chain, list(stage.end))
    assembly = MinimalCoordinates(run.chain, [Free()] * len(run.chain.links)).assembly
    momentum = np.array([assembly.gather(x) for x in shapes.T]) @ dense(assembly.mass)
    place = momentum @ (assembly.gather(run.final.q) - assembly.gather(rest.q))
    return np.concatenate([place, momentum @ assembly.gather(run.final.v)])


def _responses(stage: Stage, run: Simulation, t: Array, count: int) -> Array:
    """G (2 k, m) at times t of the first modes, whose frequencies and gains change on the way.

    An oscillator of slowly varying frequency (WKB): its phase is the integral of the frequency,
    and its amplitude goes as one over the frequency's root.
    """
    joint = stage.moving[0]
    at = np.linspace(t[0], t[-1], _POSES)
    angles = np.interp(at, run.times, run.joint_angles()[joint])
    angles += stage.end[joint] - angles[-1]  # angles are followed from the start, within a turn
    found = [_modes(stage, run.chain, joint, float(angle)) for angle in angles]
    omega = CubicSpline(at, [m.omega[:count] for m in found])
    gain = CubicSpline(at, [m.gain[:count] for m in found])(t).T

    phase = (omega.antiderivative()(t[-1]) - omega.antiderivative()(t)).T
    now, last = omega(t).T, omega(t[-1])[:, None]
    left = t[-1] - t
    place, rate = np.empty_like(phase), np.empty_like(phase)
    place[0], rate[0] = left, 1.0  # the rigid motion
    place[1:] = np.sin(phase[1:]) / np.sqrt(now[1:] * last[1:])
    rate[1:] = np.cos(phase[1:]) * np.sqrt(last[1:] / now[1:])
    return np.concatenate([gain * place, gain * rate])


def _from_zero(law: PPoly) -> PPoly:
    """The law with a piece of zero before it, from time zero on."""
    c = np.concatenate([np.zeros((len(law.c), 1)), law.c], axis=1)
    return PPoly(c, np.concatenate([[0.0], law.x]))
