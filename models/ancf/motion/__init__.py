"""The equations of motion of a chain with its joints.

`equations` states what an integrator asks of them and holds the forces that both forms share.
`minimal_coordinates` eliminates all constraints; it is the form used by default. `index1` keeps
them with multipliers and Baumgarte's stabilisation, as the paper does.
"""

from models.ancf.motion.equations import EquationsOfMotion
from models.ancf.motion.index1 import Index1
from models.ancf.motion.minimal_coordinates import MinimalCoordinates

__all__ = ["EquationsOfMotion", "Index1", "MinimalCoordinates"]
