"""A motion as its figures show it: from a replay into the arrays of a result, and back.

Names of the series are those of the law, a slash and the quantity. A law has two axes: its time,
beyond the lock as far as the replay went on, and the time since the lock.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from models.ancf.state import posed
from ocp.arrays import Array
from studies.arm.replay.full_model import LockedMotion
from studies.arm.stage import JOINT_NAMES
from studies.common.result import Result, Series

POINTS = ("elbow", "tip")
"""What is followed: the ends of the big and of the small arm."""
_AXES = "xy"
SNAPSHOTS = 9


@dataclass(frozen=True, eq=False)
class Trace:
    """A motion on the full model.

    Attributes
    ----------
    name : of the law.
    times : (m,) until the lock and as far beyond it as the motion was followed [s].
    lock : number of instants until right before the lock.
    torque : (2, m) of root and elbow [N m], zero beyond the lock.
    path, velocity : (2, m) of elbow and tip [m], [m/s].
    since_lock : (k,) [s], empty where the motion was not followed.
    off_rest : (2, k) of elbow and tip, from where each comes to rest [m].
    """

    name: str
    times: Array
    lock: int
    torque: Array
    path: Mapping[str, Array]
    velocity: Mapping[str, Array]
    since_lock: Array
    off_rest: Mapping[str, Array]

    @classmethod
    def of(cls, replayed: LockedMotion, name: str | None = None) -> Trace:
        """The trace of a replay, under its motion's name or another."""
        before, after = replayed.run.before, replayed.run.after
        runs = [before] if after is None else [before, after]
        chain = before.chain
        slots = {point: list(chain.slots(link, -1)[:2]) for link, point in enumerate(POINTS)}

        # a locked joint bears a torque that no drive gives: it is left at zero

        torque = np.zeros((2, sum(len(run.times) for run in runs)))
        torque[:, : len(before.times)] = before.torque

        since_lock, off_rest = np.empty(0), {point: np.empty((2, 0)) for point in POINTS}
        if after is not None:
            # it comes to rest at the angles that the lock holds
            since_lock = after.times - after.times[0]
            rest = posed(chain, [float(x) for x in after.joint_angles()[:, 0]]).q
            off_rest = {point: after.q[place] - rest[place, None] for point, place in slots.items()}

        return cls(
            name=name or replayed.motion.name,
            times=np.concatenate([run.times for run in runs]),
            lock=len(before.times),
            torque=torque,
            path={
                point: np.concatenate([run.position(link) for run in runs], axis=1)
                for link, point in enumerate(POINTS)
            },
            velocity={
                point: np.concatenate([run.v[place] for run in runs], axis=1)
                for point, place in slots.items()
            },
            since_lock=since_lock,
            off_rest=off_rest,
        )

    def series(self) -> dict[str, Series]:
        """The arrays of a result that hold this trace."""
        head, axis = f"{self.name}/", f"{self.name}/time"
        # a flag for each instant, as a series holds nothing but numbers
        held = (np.arange(len(self.times)) >= self.lock).astype(float)
        arrays = {
            axis: Series("s", axis, self.times, "since the release"),
            f"{head}locked": Series("1", axis, held, "1 from the lock on"),
        }
        for k, joint in enumerate(JOINT_NAMES):
            name = f"{head}{joint}_torque"
            arrays[name] = Series("N m", axis, self.torque[k], f"torque of the {joint}")
        for point in POINTS:
            for k, direction in enumerate(_AXES):
                place, speed = self.path[point][k], self.velocity[point][k]
                arrays[f"{head}{point}_{direction}"] = Series("m", axis, place, "place")
                arrays[f"{head}{point}_v{direction}"] = Series("m/s", axis, speed, "velocity")

        if self.since_lock.size:
            axis = f"{head}time_since_lock"
            arrays[axis] = Series("s", axis, self.since_lock, "since the lock")
            for point in POINTS:
                for k, direction in enumerate(_AXES):
                    name = f"{head}{point}_off_{direction}"
                    off = self.off_rest[point][k]
                    arrays[name] = Series("m", axis, off, "from where it comes to rest")
        return arrays

    @classmethod
    def read(cls, result: Result, name: str) -> Trace:
        """The trace of a law that a result holds."""
        arrays = result.arrays

        def values(quantity: str) -> Array:
            series = arrays.get(f"{name}/{quantity}")
            return np.empty(0) if series is None else series.values

        def pairs(kind: str) -> dict[str, Array]:
            return {
                point: np.array([values(f"{point}_{kind}{direction}") for direction in _AXES])
                for point in POINTS
            }

        return cls(
            name=name,
            times=values("time"),
            lock=int(np.count_nonzero(values("locked") == 0.0)),
            torque=np.array([values(f"{joint}_torque") for joint in JOINT_NAMES]),
            path=pairs(""),
            velocity=pairs("v"),
            since_lock=values("time_since_lock"),
            off_rest=pairs("off_"),
        )


def traced_laws(result: Result) -> list[str]:
    """Names of the laws of which a result holds a trace, in its order."""
    return [name.removesuffix("/locked") for name in result.arrays if name.endswith("/locked")]


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The arm at an instant [s]: nodes of the big and of the small arm, (2, n) [m]."""

    time: float
    big: Array
    small: Array


def snapshots_of(replayed: LockedMotion) -> list[Snapshot]:
    """The arm at even instants until the lock."""
    run = replayed.run.before
    snapshots = []
    for asked in np.linspace(0.0, run.times[-1], SNAPSHOTS):
        i = int(np.argmin(np.abs(run.times - asked)))
        big, small = (
            np.array([run.position(link, node)[:, i] for node in range(run.chain.nodes)]).T
            for link in (0, 1)
        )
        snapshots.append(Snapshot(float(asked), big, small))
    return snapshots


def snapshot_series(snapshots: Sequence[Snapshot]) -> dict[str, Series]:
    """The arrays of a result that hold snapshots, along the nodes of both arms."""
    nodes = snapshots[0].big.shape[1] + snapshots[0].small.shape[1]
    axis = "snapshots/node"
    arrays = {axis: Series("1", axis, np.arange(nodes), "nodes of the big and of the small arm")}
    for k, snapshot in enumerate(snapshots):
        places = np.concatenate((snapshot.big, snapshot.small), axis=1)
        for direction, values in zip(_AXES, places, strict=True):
            name = f"snapshots/{k}_{direction}"
            arrays[name] = Series("m", axis, values, f"at {snapshot.time:.6g} s")
    return arrays


def read_snapshots(result: Result) -> list[Snapshot]:
    """The snapshots that a result holds; none if it holds none."""
    snapshots: list[Snapshot] = []
    for k, time in enumerate(result.details.get("snapshot_times", ())):
        places = np.array([result.arrays[f"snapshots/{k}_{axis}"].values for axis in _AXES])
        big, small = np.split(places, 2, axis=1)
        snapshots.append(Snapshot(float(time), big, small))
    return snapshots
