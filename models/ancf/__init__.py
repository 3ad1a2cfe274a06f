"""Chains of flexible links, modelled by planar ANCF beam elements.

`element` is one element, `chain` says what links are hinged together, `assembly` builds the
chain's matrices and `state` holds node coordinates and rates. What is done at the hinges is in
`joints/`, the equations of motion are in `motion/` and their integration over time in
`integrate/`. Natural modes, equilibrium and locks are in `analysis/`.
"""
