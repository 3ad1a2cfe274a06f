"""From what is wrong with a solved mesh to the next one.

`policy` says what is asked of a policy. `adaptive_mesh` is the default: `marks` say which intervals
are cut, `brackets` stand around jumps, `movable` tells when moving breakpoints are in the way, and
`back_off` closes leaks. `moving_mesh` is for families.
"""
