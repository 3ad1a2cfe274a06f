"""The diagnostics that `certify` asks by default, in their order."""

from ocp.diagnostics.diagnostic import Diagnostic
from ocp.diagnostics.motion_conditions import motion_conditions
from ocp.diagnostics.optimality_conditions import optimality_conditions, other_controls_condition
from ocp.diagnostics.program_conditions import program_conditions
from ocp.diagnostics.second_solve import confirm

STANDARD: tuple[Diagnostic, ...] = (
    motion_conditions,
    program_conditions,
    optimality_conditions,
    other_controls_condition,
    confirm,
)
