"""Collocation schemes by the names that messages use."""

from ocp.numerics.schemes import SCHEMES

BY_NAME = {scheme.name: scheme for scheme in SCHEMES.values()}


def scheme_named(name, degree):
    """The scheme of that name, with as many points where it has a choice."""
    kind = BY_NAME[name]
    return kind() if kind.fixed_degree else kind(degree)
