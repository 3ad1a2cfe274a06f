"""Numerics that know no problem: collocation schemes, polynomials, integrators."""
