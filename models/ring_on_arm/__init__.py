"""The ring truss on the arm that carries it: while the ring opens, it shakes the arm.

`equations` has both as one mechanism: the arm's equations of motion, and what its tip does to the
ring. `motion` has numbers along a motion law of the ring. `rigid` has what both hand to the
satellite where the arm does not bend, in closed forms.
"""

from models.ring_on_arm.equations import RingOnArm
from models.ring_on_arm.motion import ArmMotion, arm_motion
from models.ring_on_arm.rigid import free_turn, held_moment, held_momentum

__all__ = ["ArmMotion", "RingOnArm", "arm_motion", "free_turn", "held_moment", "held_momentum"]
