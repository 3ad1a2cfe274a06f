"""What is done at the hinges of a chain.

The kinds of joint (free, torque, locked, driven) are in `kinds`, the measured angles and their
rates in `angles`. A locked or driven joint ties the slopes on either side (`ties`). In the
equations of motion ties have two forms: constraints with multipliers (`constraints`), or
eliminated from the coordinates (`elimination`).
"""

from models.ancf.joints.angles import joint_angles, joint_rates, quarter, rotate, slope_pair
from models.ancf.joints.jumps import breakpoints
from models.ancf.joints.kinds import (
    Driven,
    Free,
    Joint,
    LastAsked,
    Locked,
    Torque,
    check_joints,
    law_values,
)

__all__ = [
    "Driven",
    "Free",
    "Joint",
    "LastAsked",
    "Locked",
    "Torque",
    "breakpoints",
    "check_joints",
    "joint_angles",
    "joint_rates",
    "law_values",
    "quarter",
    "rotate",
    "slope_pair",
]
