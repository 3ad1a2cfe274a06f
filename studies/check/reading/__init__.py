"""A file into times and values in SI: dialects, headers, units, and what contradicts itself."""
