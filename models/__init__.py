"""Mechanical models as pure functions of symbols; they know no optimiser and no plot.

`truss` is the ring truss of the antenna and `laws` are the motion laws of its deployment angle.
`ancf` models chains of flexible links, and `arm` is the supporting arm made of two of them, in
full and reduced to a few coordinates. What they share is in `numerics`, `arrays` and `errors`.
"""
