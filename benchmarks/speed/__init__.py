"""Parts of the race that measure our own code alone: growth, families, repeats, imports."""
