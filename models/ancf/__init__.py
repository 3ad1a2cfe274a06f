"""Planar ANCF beams: element, chains, simulation, modes and locks."""
