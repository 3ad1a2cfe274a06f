"""Mixing of two catalysts along a plug-flow reactor."""

from benchmarks.optima.benchmark import Benchmark
from ocp import Constant, Control, Phase, Problem, State


def catmix() -> Benchmark:
    """Largest yield of the product by the mixing ratio u along the reactor.

    ``min -1 + a(1) + b(1), a' = u (10 b - a), b' = u (a - 10 b) - (1 - u) b, 0 <= u <= 1``,
    from (1, 0).  The optimal u is bang - singular - bang.

    Source: E. D. Dolan, J. J. More, T. S. Munson, COPS 3.0 (2004), "catmix" (-4.80556e-2).
    """
    a, b = State("a", lower=0, upper=1.1), State("b", lower=0, upper=1.1)
    u = Control("u", lower=0, upper=1)
    rate = Constant("rate", "1", 10)
    exchange = u * (rate * b - a)

    reactor = Phase(
        "reactor",
        {a: exchange, b: -exchange - (1 - u) * b},
        initial={a: 1, b: 0},
        end=1,
        guess={a: 1, b: 0, u: 0.3},
    )

    return Benchmark(
        Problem("catmix", (reactor,), minimise=-1 + reactor.at_end(a) + reactor.at_end(b)),
        optimum=-0.04805568445,
        tolerance=1e-6,
        source="COPS 3.0, catmix (-4.80556e-2); refined computation",
    )
