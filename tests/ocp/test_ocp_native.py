"""Kernels compiled to machine code."""

import casadi as ca
import numpy as np
import pytest

from ocp import Control, Phase, Problem, Settings, State, StatementError, solve
from ocp.native import cache, compiled, compiler


def have_compiler():
    try:
        return bool(compiler())
    except StatementError:
        return False


needs_compiler = pytest.mark.skipif(not have_compiler(), reason="there is no C compiler")


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def some_functions():
    x = ca.SX.sym("x", 3)
    return [ca.Function("a", [x], [ca.sin(x) * x[0]]), ca.Function("b", [x], [ca.sumsqr(x)])]


@needs_compiler
def test_compiled_functions_are_the_same_functions():
    at = np.array([0.3, -1.2, 2.0])
    for own, native in zip(some_functions(), compiled(some_functions()), strict=True):
        assert native.name() == own.name()
        # the compiler may fuse a product and a sum
        np.testing.assert_allclose(native(at).full(), own(at).full(), rtol=1e-14)
        np.testing.assert_allclose(
            native.map(4)(np.outer(at, np.arange(4))).full(),
            own.map(4)(np.outer(at, np.arange(4))).full(), rtol=1e-14,
        )  # fmt: skip


@needs_compiler
def test_a_library_is_compiled_once(monkeypatch):
    compiled(some_functions())
    (library,) = cache().iterdir()
    monkeypatch.setattr("subprocess.run", None)
    compiled(some_functions())
    assert [*cache().iterdir()] == [library]


@needs_compiler
def test_a_compiled_solve_is_the_same_solve():
    x, u = State("x"), Control("u")
    phase = Phase("p", {x: u - x**3}, initial={x: 1}, final={x: 0}, end=1.0)
    problem = Problem("decay", phase, minimise=phase.integral(u**2))
    usual, native = (
        solve(problem, settings=Settings(refine=False, intervals=4, degree=3, compile=c))
        for c in (False, True)
    )
    assert any(cache().iterdir())
    assert native.objective == pytest.approx(usual.objective, rel=1e-12)


def test_a_missing_compiler_is_named(monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler -m64")
    with pytest.raises(StatementError, match="there is no 'no-such-compiler -m64'; install one"):
        compiled(some_functions())


@needs_compiler
def test_a_failing_compiler_is_quoted(monkeypatch):
    monkeypatch.setenv("CC", "cc --no-such-flag")
    with pytest.raises(StatementError, match=r"'cc' failed with: .*; name another one"):
        compiled(some_functions())
