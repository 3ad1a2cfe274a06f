"""From a case to the models: the chain, its joints and where it starts; and variants of a case.

Symbols: q, v node vector and rates (size,); J rigid inertia about a joint [kg m^2].
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from models.ancf.assembly import assemble, dense
from models.ancf.chain import Chain
from models.ancf.integrate import StepControl
from models.ancf.joints import Joint
from models.ancf.state import NodalState, posed
from models.errors import ModelError
from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.flex.config import SWEEPS, FlexStudy
from studies.flex.drives import check_laws, joint_law, joint_of

SAME_ANGLE = 1e-6  # [rad]; tolerance between a given start and that of a law


@dataclass(frozen=True, eq=False)
class FlexChain:
    """A case, ready to be moved.

    Attributes
    ----------
    study : FlexStudy
    chain : Chain
    joints : what is done at each joint.
    state : where it starts.
    angles : joint angles at the start (L,) [rad], whole turns included.
    settings : of the integrator.
    """

    study: FlexStudy
    chain: Chain
    joints: tuple[Joint, ...]
    state: NodalState
    angles: Array
    settings: StepControl


def build(study: FlexStudy) -> FlexChain:
    """Build the models of a case.

    Raises
    ------
    StudyError
        If a law is not finite, or the start of the chain contradicts it.
    """
    check_laws(study)
    ends = tuple(link.end_mass for link in study.link)
    try:
        chain = Chain(
            links=study.links,
            elements=study.elements,
            masses=(0.0, *ends) if any(ends) else (),
            hub_inertia=study.hub_inertia,
            gravity=(study.gravity[0], study.gravity[1]),
            damping_ratio=study.damping_ratio,
            damping_frequency=study.damping_frequency,
        )
        step = None if study.step is None else study.step / study.pace
        settings = StepControl(study.tolerance, fixed_step=step)
    except ModelError as error:
        raise StudyError(str(error)) from error

    starts = [_start(study, place) for place in range(len(study.joint))]
    angles, rates = np.array([s[0] for s in starts]), np.array([s[1] for s in starts])
    state = moving(chain, angles, rates)
    joints = tuple(
        joint_of(study, place, rigid_inertia(chain, angles, place))
        for place in range(len(study.joint))
    )
    return FlexChain(study, chain, joints, state, angles, settings)


def _start(study: FlexStudy, place: int) -> tuple[float, float]:
    """Angle [rad] and rate [rad/s] of a joint at the start."""
    case = study.joint[place]
    if case.kind != "angle":
        return case.start, case.start_rate * study.pace

    angle, rate, _ = (float(part[0]) for part in joint_law(study, place).history(np.zeros(1)))
    if case.start_deg is not None and abs(angle - case.start) > SAME_ANGLE:
        raise StudyError(
            f"joint[{place}].start_deg is {case.start_deg:g}, but its law starts at "
            f"{math.degrees(angle):.6g} deg; leave start_deg out or change the law"
        )
    return angle, rate


def moving(chain: Chain, angles: Array, rates: Array) -> NodalState:
    """The undeformed chain with joint angles (L,) [rad] that turn at rates (L,) [rad/s]."""
    state = posed(chain, list(angles))
    v, before = np.zeros(chain.size), np.zeros(2)
    for link, turning in enumerate(np.cumsum(rates)):
        root = state.q[list(chain.slots(link, 0)[:2])]
        for node in range(chain.nodes):
            rx, ry, tx, ty = chain.slots(link, node)
            arm = state.q[[rx, ry]] - root
            v[[rx, ry]] = before + turning * np.array([-arm[1], arm[0]])
            v[[tx, ty]] = turning * np.array([-state.q[ty], state.q[tx]])
        before = v[list(chain.slots(link, -1)[:2])]
    return NodalState(state.q, v)


def rigid_inertia(chain: Chain, angles: Array, place: int) -> float:
    """J of all that hangs on a joint, turned as one rigid body in the pose of the start."""
    rates = np.zeros(len(angles))
    rates[place] = 1.0
    assembly = assemble(chain)
    rate = assembly.gather(moving(chain, angles, rates).v)
    return float(rate @ dense(assembly.mass) @ rate)


def variants(study: FlexStudy) -> list[tuple[str, float, FlexStudy]]:
    """What the sweep asks for: quantity, multiple and case, one quantity changed at a time."""
    found = []
    plain = dataclasses.replace(study, sweep=type(study.sweep)(), mesh_check=False)
    for quantity in SWEEPS:
        for factor in getattr(study.sweep, quantity):
            if factor != 1.0:
                found.append((quantity, factor, _changed(plain, quantity, factor)))
    return found


def _changed(study: FlexStudy, quantity: str, factor: float) -> FlexStudy:
    if quantity == "speed":
        return dataclasses.replace(study, pace=factor * study.pace)
    if quantity == "length":
        links = [dataclasses.replace(link, length=factor * link.length) for link in study.link]
        return dataclasses.replace(study, link=tuple(links))
    links = [
        link if link.modulus is None else dataclasses.replace(link, modulus=factor * link.modulus)
        for link in study.link
    ]
    materials = {
        name: dataclasses.replace(material, modulus=factor * material.modulus)
        for name, material in study.material.items()
    }
    return dataclasses.replace(study, link=tuple(links), material=materials)
