"""What is wrong with a solved mesh, and what a better one could gain.

`error_estimate` puts it together: dynamics and limits between the points. `promised_gain` says what
finer controls could bring, `other_controls` what controls far away could, `constrained_arcs` what
is lost where a path acts, `missed_switches` what a breakpoint at the wrong place costs,
`back_off_cost` what limits that are backed off keep, and `excess_price` what an excess is worth.
`control_trials` tries controls far away, and `control_limits` keeps them within shared limits.
`switch_detection` finds the jumps of controls, `control_resolution` says how well their shapes are
resolved, and `active_set_changes` where limits are met or left.
"""
