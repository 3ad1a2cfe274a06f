"""The ring truss: expressions in, expressions out, after DOI 10.1109/ACCESS.2019.2918614.

`parameters` says what is given and `kinematics` where the nodes and the rope are at an angle.
The equation of motion is in `dynamics`, made of `inertia`, `potential`, `friction` and `rope`.
Numbers along a motion are in `evaluate` and, for single nodes, in `nodes`. `bounds` holds the
least peaks that any motion has.
"""

from models.truss.bar_forces import (
    KINDS,
    BarForces,
    bar_forces,
    extreme_bar_forces,
    hoop_force,
    largest_bar_force,
)
from models.truss.bounds import (
    centre_travel,
    least_peak_reaction,
    least_peak_rope_acceleration,
    rope_travel,
)
from models.truss.buckling import buckling_load, buckling_shares, play_angle
from models.truss.dynamics import (
    ForceCoefficients,
    StaticPeak,
    angular_acceleration,
    force_coefficients,
    rope_force,
    static_force,
    static_peak,
    static_torque,
)
from models.truss.evaluate import TrussMotion, evaluate_motion
from models.truss.friction import coulomb_torque, joint_damping, joint_loss, one_way
from models.truss.gravity import gravity_potential, gravity_slope
from models.truss.inertia import (
    inertia,
    inertia_slope,
    kinetic_energy,
    linear_momentum,
    reaction_force,
    total_mass,
)
from models.truss.inertia_loads import InertiaLoads, inertia_loads
from models.truss.kinematics import (
    angle_from_rope_length,
    node_position,
    ring_radius,
    rope_acceleration,
    rope_jerk,
    rope_length,
    rope_speed,
    slider_distance,
    slider_distance_curvature,
    slider_distance_slope,
    slider_distance_third,
)
from models.truss.nodes import NodeMotion, node_motion, ring_positions
from models.truss.opening import Opening, whole_opening
from models.truss.parameters import (
    DYNAMIC_SET,
    KINEMATIC_SET,
    TUBE_LINEAR_DENSITY,
    JointMasses,
    TrussParameters,
    with_symbols,
)
from models.truss.potential import Net, potential, potential_slope
from models.truss.ring_forces import RingForces, ring_forces
from models.truss.rope import (
    far_end_ratio,
    mean_tension_ratio,
    pulley_loss,
    pulley_loss_by_sum,
    rope_leverage,
    tension_ratios,
)
from models.truss.rope_stiffness import (
    LeastStiffness,
    RopeYields,
    jerk_step_at_net,
    least_rope_stiffness,
    rope_mode_frequency,
    rope_taken,
    stretching_ratio,
    wound_rope,
    yielding_tension,
)
from models.truss.rope_swing import RopeSwing, WoundRope, rope_swing
from models.truss.shear import module_shear

__all__ = [
    "DYNAMIC_SET",
    "KINDS",
    "KINEMATIC_SET",
    "TUBE_LINEAR_DENSITY",
    "BarForces",
    "ForceCoefficients",
    "InertiaLoads",
    "JointMasses",
    "LeastStiffness",
    "Net",
    "NodeMotion",
    "Opening",
    "RingForces",
    "RopeSwing",
    "RopeYields",
    "StaticPeak",
    "TrussMotion",
    "TrussParameters",
    "WoundRope",
    "angle_from_rope_length",
    "angular_acceleration",
    "bar_forces",
    "buckling_load",
    "buckling_shares",
    "centre_travel",
    "coulomb_torque",
    "evaluate_motion",
    "extreme_bar_forces",
    "far_end_ratio",
    "force_coefficients",
    "gravity_potential",
    "gravity_slope",
    "hoop_force",
    "inertia",
    "inertia_loads",
    "inertia_slope",
    "jerk_step_at_net",
    "joint_damping",
    "joint_loss",
    "kinetic_energy",
    "largest_bar_force",
    "least_peak_reaction",
    "least_peak_rope_acceleration",
    "least_rope_stiffness",
    "linear_momentum",
    "mean_tension_ratio",
    "module_shear",
    "node_motion",
    "node_position",
    "one_way",
    "play_angle",
    "potential",
    "potential_slope",
    "pulley_loss",
    "pulley_loss_by_sum",
    "reaction_force",
    "ring_forces",
    "ring_positions",
    "ring_radius",
    "rope_acceleration",
    "rope_force",
    "rope_jerk",
    "rope_length",
    "rope_leverage",
    "rope_mode_frequency",
    "rope_speed",
    "rope_swing",
    "rope_taken",
    "rope_travel",
    "slider_distance",
    "slider_distance_curvature",
    "slider_distance_slope",
    "slider_distance_third",
    "static_force",
    "static_peak",
    "static_torque",
    "stretching_ratio",
    "tension_ratios",
    "total_mass",
    "whole_opening",
    "with_symbols",
    "wound_rope",
    "yielding_tension",
]
