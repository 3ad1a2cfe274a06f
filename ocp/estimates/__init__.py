"""What is wrong with a solved mesh, and what a better one could gain.

`motion_errors` measures dynamics and limits between the points. `error_estimate` puts that together
with what is lost: `estimated_gain` by finer controls, and `constrained_arcs` where a path acts.

`switch_detection` finds the jumps of controls, and `kink_crossings` where the motion crosses kinks.
"""
