"""What is wrong with a solved mesh, and what a better one could gain.

`motion_errors` measures dynamics and limits between the points. `error_estimate` puts that together
with what is lost. `promised_gain` says what finer controls could bring, `constrained_arcs` what is
lost where a path acts, and `other_controls` what controls far away could gain.

`switch_detection` finds the jumps of controls, and `kink_crossings` where the motion crosses kinks.
"""
