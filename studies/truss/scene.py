"""What a report shows of the truss: curves of all laws, tension along the rope, the antenna."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from models.truss import ring_radius, slider_distance_slope
from models.truss.wireframe import shape_weights, tension_exponents, wireframe
from ocp.arrays import Array
from studies.common.charts import TIME, Chart, ChartAxis, Curve, Level, charts_of_arrays
from studies.common.result import Result
from studies.common.scene.moving_picture import LawOfMotion, MovingPicture, RopeTension, Strand
from studies.truss.motions.deployment import COLUMNS, Deployment, profile
from studies.truss.motions.laws import deployments_of

ROWS = 257  # of the geometry table: a cubic between two rows is exact to 1e-10 m
SAMPLES = 1001  # of a law: a cubic between two of them is exact to 1e-8 rad
JUMP = 1e-9  # of the duration between the two sides of a jump
AXES = (
    ChartAxis(TIME, "time", "s"),
    ChartAxis("angle", "deployment angle", "deg"),
    ChartAxis("rope", "rope length", "m"),
)

# columns of a profile as charts, in the order shown: title; caps and bounds of these quantities
SHOWN: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "motor_force": ("force of the motor on one rope", ("peak-force",)),
    "angle_deg": ("deployment angle", ()),
    "angular_speed": ("angular speed", ("peak-speed",)),
    "angular_acceleration": ("angular acceleration", ("peak-acceleration",)),
    "angular_jerk": ("angular jerk", ("peak-jerk",)),
    "rope_length": ("length of one rope", ()),
    "rope_speed": ("rope speed, negative while wound in", ()),
    "rope_acceleration": ("rope acceleration", ("peak-rope-acceleration",)),
    "far_end_tension": ("tension of the rope's last segment", ("least-tension",)),
    "motor_power": ("power of both motors", ("peak-power",)),
    "reaction_force": ("reaction on the supporting arm", ("peak-reaction",)),
    "joint_power": ("power lost in the joints", ()),
    "pulley_power": ("power lost in the pulleys", ()),
    "kinetic_energy": ("kinetic energy", ()),
    "potential_energy": ("potential energy of springs and net", ()),
}
# whose cap holds on either side of zero
_SIGNED = {"angular_acceleration", "angular_jerk", "rope_acceleration", "reaction_force"}


def charts(result: Result) -> tuple[Chart, ...]:
    """All curves of the result and of the laws beside it; its own law is the first."""
    if "angle" not in result.arrays:
        return charts_of_arrays(result)
    deployments = deployments_of(result)
    profiles = _profiles(result, deployments)
    found = [_chart(result, name, profiles) for name in SHOWN]
    paths = _force_against_speed(profiles), *_torque_against_speed(deployments)
    return (*found[:1], *paths, *found[1:])


def _profiles(result: Result, deployments: Sequence[Deployment]) -> dict[str, dict[str, Array]]:
    """Columns of each law: the result's own as they are stored."""
    own, *others = deployments
    stored = {name: result.arrays[name].values for name in COLUMNS if name in result.arrays}
    computed = {deployment.name: profile(deployment, SAMPLES) for deployment in others}
    return {own.name: stored, **computed}


def _chart(result: Result, name: str, profiles: Mapping[str, Mapping[str, Array]]) -> Chart:
    title, quantities = SHOWN[name]
    curves = [
        _curve(law, name, columns) for law, columns in profiles.items() if _known(name, columns)
    ]
    unit = "deg" if name == "angle_deg" else COLUMNS[name][0]
    levels = _levels(result, quantities, name in _SIGNED)
    axes = tuple(axis for axis in AXES if (axis.key, name) not in _ITSELF)
    return Chart(f"truss-{name}", title, unit, axes, tuple(curves), levels)


_ITSELF = {("angle", "angle_deg"), ("rope", "rope_length")}


def _known(name: str, columns: Mapping[str, Array]) -> bool:
    return name in columns or (name == "angle_deg" and "angle" in columns)


def _curve(law: str, name: str, columns: Mapping[str, Array]) -> Curve:
    """A column over all axes; what jumps has two values at a jump."""
    places = {
        TIME: columns["time"],
        "angle": np.degrees(columns["angle"]),
        "rope": columns["rope_length"],
    }
    values = np.degrees(columns["angle"]) if name == "angle_deg" else columns[name]
    before = columns.get(f"{name}_before")
    if before is not None:
        return _with_jumps(law, places, before, values)
    return Curve(law, places, values)


def _with_jumps(law: str, places: Mapping[str, Array], before: Array, after: Array) -> Curve:
    size = np.abs(after).max(initial=0.0)
    jumps = np.flatnonzero(np.abs(after - before) > 1e-9 * size)
    doubled = {}
    for key, values in places.items():
        shift = JUMP * (values[-1] - values[0])
        doubled[key] = np.insert(values, jumps, values[jumps] - shift)
    return Curve(law, doubled, np.insert(after, jumps, before[jumps]))


def _levels(result: Result, quantities: Sequence[str], signed: bool) -> tuple[Level, ...]:
    """Caps, and the bound of what is minimised."""
    found = []
    rows = {row.key: row for row in result.table}
    for row in (rows[key] for key in quantities if key in rows):
        limits = [("cap", row.cap)] + [("bound", row.bound)] * row.minimised
        for name, value in limits:
            if value is not None and np.isfinite(value):
                found += [Level(name, sign * value) for sign in ((1.0, -1.0) if signed else (1.0,))]
    return tuple(found)


def _force_against_speed(profiles: Mapping[str, Mapping[str, Array]]) -> Chart:
    """What a motor must give: force on the rope against the speed at which it is wound in."""
    curves = []
    for law, columns in profiles.items():
        if {"motor_force", "rope_speed"} <= columns.keys():
            places = {"wind": -columns["rope_speed"], TIME: columns["time"]}
            curves.append(Curve(law, places, columns["motor_force"]))
    axis = ChartAxis("wind", "speed at which the rope is wound in", "m/s")
    return Chart(
        "truss-force-speed",
        "force on the rope against speed",
        "N",
        (axis,),
        tuple(curves),
        path=True,
    )


def _torque_against_speed(deployments: Sequence[Deployment]) -> tuple[Chart, ...]:
    """The path of one motor's shaft and what the motor can do; nothing without a drum."""
    axis, drive = ChartAxis("shaft", "speed of the shaft", "rad/s"), deployments[0].drive
    if drive is None or drive.drum_radius is None:
        return ()
    curves = []
    for deployment in deployments:
        time = np.linspace(0.0, deployment.law.duration, SAMPLES)
        motor = deployment.motor(deployment.at(time)[1])
        places = {axis.key: motor.shaft_speed, TIME: time}
        curves.append(Curve(deployment.name, places, motor.torque))
    if drive.torque_speed is not None:
        speed, torque = np.array(drive.torque_speed).T
        curves.append(Curve("torque-speed curve", {axis.key: speed}, torque))
    title = "torque against speed that the motor must supply"
    return (Chart("truss-torque-speed", title, "N m", (axis,), tuple(curves), path=True),)


def scene(result: Result) -> MovingPicture | None:
    """The antenna of a result, and how each law moves it; None of a result without an angle."""
    return moving_antenna(deployments_of(result)) if "angle" in result.arrays else None


def moving_antenna(deployments: Sequence[Deployment]) -> MovingPicture:
    """The antenna, and how each law moves it; all on the truss of the first one."""
    truss = deployments[0].truss
    frame = wireframe(truss)
    alpha = np.linspace(truss.stowed_angle, np.pi / 2, ROWS)
    e_slopes = np.array([float(slider_distance_slope(truss, angle)) for angle in alpha])
    slopes = [np.zeros(ROWS), np.cos(alpha), -np.sin(alpha), e_slopes]

    return MovingPicture(
        title=f"ring truss of {truss.modules} modules, ropes coloured by their tension",
        shapes=frame.shapes,
        parameter=alpha,
        weights=shape_weights(truss, alpha),
        slopes=np.stack(slopes, axis=1),
        strands=tuple(Strand(kind, pairs) for kind, pairs in frame.lines.items()),
        centre=frame.centre,
        laws=tuple(law_of(deployment) for deployment in deployments),
        # segment k bears T1 exp(w_0 + w_1 alpha), (29)
        tension=RopeTension(frame.ropes, tension_exponents(truss)),
        slack={"net": truss.net_angle},
        size=2 * float(ring_radius(truss, np.pi / 2)),
    )


def law_of(deployment: Deployment) -> LawOfMotion:
    """Angle, speed, force and rope length of a law."""
    columns = profile(deployment, SAMPLES)
    return LawOfMotion(
        name=deployment.name,
        times=columns["time"],
        values=columns["angle"],
        rates=columns["angular_speed"],
        force=columns["motor_force"],
        rope_length=columns["rope_length"],
    )
