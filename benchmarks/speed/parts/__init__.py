"""The parts of `python -m benchmarks.race` that measure our own code alone."""
