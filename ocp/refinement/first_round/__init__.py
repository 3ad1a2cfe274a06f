"""The first mesh, from more than one start where the guess leads nowhere or may be far off.

`first_motion` begins, and goes by `past_kinks` and `rounded_kinks` where kinks are in the way.
`first_answer` decides, by `convexity` among others. `starts` makes other starts and runs the solver
from them. `search` compares what comes of several.
"""
