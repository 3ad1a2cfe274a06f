"""The engine beside other tools and hand-written programs: `python -m benchmarks.race`."""
