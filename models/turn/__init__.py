"""Stage 2 of the deployment: the folded antenna turns about the axis of the big arm.

`parameters` says what turns on what; `dynamics` is its equation of motion; `closed_form` is the
turn of least peak torque, and `response` what the antenna does under any drive that is sampled.
"""

from models.turn.closed_form import (
    BangTurn,
    least_torque_bound,
    least_torque_turn,
    least_turn_time_bound,
    torque_limited_turn,
)
from models.turn.dynamics import antenna_acceleration, swing_energy, torque
from models.turn.parameters import TurnParameters, stowed_ring_inertia, torsion_stiffness
from models.turn.response import TurnResponse, turn_response

__all__ = [
    "BangTurn",
    "TurnParameters",
    "TurnResponse",
    "antenna_acceleration",
    "least_torque_bound",
    "least_torque_turn",
    "least_turn_time_bound",
    "stowed_ring_inertia",
    "swing_energy",
    "torque",
    "torque_limited_turn",
    "torsion_stiffness",
    "turn_response",
]
