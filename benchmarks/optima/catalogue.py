"""The benchmark problems: the families of the shows with their nominal numbers, in their order."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from benchmarks.optima.benchmark import Benchmark
from benchmarks.shows.engine.engine_problem import problem_of
from benchmarks.shows.engine.variant import Variant, catalogue, evaluated


def _benchmark(name: str) -> Benchmark:
    variant = Variant.nominal(name)
    stated = variant.stated
    return Benchmark(
        problem_of(variant, guessed=True),
        float(evaluated(stated["optimum"], {})),
        stated["tolerance"],
        stated["source"],
    )


CATALOGUE: Mapping[str, Callable[[], Benchmark]] = {
    name: partial(_benchmark, name) for name in catalogue()
}
