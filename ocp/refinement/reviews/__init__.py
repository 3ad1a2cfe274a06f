"""Reviews of an answer of the loop: what it misses, and where a refinement goes on from there.

The loop of mesh iterations looks at the points of a motion and between them. A review looks at the
motion as a whole, and is dear beside that. `finding` says what one tells; the order in which they
are asked is that of `ocp.refinement.refine`.
"""
