"""The first mesh, from more than one start where the guess leads nowhere or may be far off.

`first_answer` decides, by `convexity` among others. `starts` makes other starts and runs the solver
from them. `search` compares what comes of several.
"""
