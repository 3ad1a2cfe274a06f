"""From what is wrong with a solved mesh to the next one.

`policy` says what is asked of a policy. `adaptive_mesh` is the default: it decides what the whole
mesh demands, and `next_phase` makes the next mesh of each phase. There `brackets` stand around
jumps, `kink_breakpoints` on kinks, and `back_off` removes violations between the points.
`moving_mesh` is for families.
"""
