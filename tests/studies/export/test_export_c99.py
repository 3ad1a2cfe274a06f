"""The C code compiles without a warning, and says what the profile and CasADi's own code say."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from ocp.arrays import Array
from studies.cli import main
from studies.common.result import Result
from studies.export import c99
from studies.export.polynomials import Segments, exact_segments, fitted_segments
from studies.export.source import source_of

COMPILER = next((name for name in ("cc", "gcc", "clang") if shutil.which(name)), None)
FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-Wconversion", "-pedantic", "-O1")
TIMES = np.linspace(0.0, 140.0, 10_000)

needs_compiler = pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")


def compiled(source: str, folder: Path, flags: tuple[str, ...] = FLAGS) -> Path:
    """A shared library of a C source."""
    code, library = folder / "code.c", folder / "code.so"
    code.write_text(source, "utf-8")
    assert COMPILER is not None
    command = [COMPILER, *flags, "-shared", "-fPIC", str(code), "-o", str(library)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return library


def played_in_c(library: Path, real: str, times: Array) -> Array:
    """Position, velocity and acceleration of the compiled function, (3, m)."""
    kind = ctypes.c_double if real == "double" else ctypes.c_float
    function = ctypes.CDLL(str(library)).set_point_at
    function.argtypes = [kind, *[ctypes.POINTER(kind)] * 3]
    rows = []
    for time in times.tolist():
        outputs = [kind() for _ in range(3)]
        function(kind(time), *map(ctypes.byref, outputs))
        rows.append([output.value for output in outputs])
    return np.array(rows).T


def segments_of(result: Result, signal: str) -> Segments:
    source = source_of(result)
    if signal == "angle":
        assert source.law is not None
        return exact_segments(source.law)
    return fitted_segments(source.course("rope"))


@needs_compiler
@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("signal", ["rope", "angle"])
def test_the_code_says_what_the_profile_says(
    slow: Result, signal: str, real: str, tmp_path: Path
) -> None:
    course = source_of(slow).course(signal)
    library = compiled(c99.write_source(segments_of(slow, signal), {"a": "*/ b"}, real), tmp_path)
    found = played_in_c(library, real, TIMES)
    exact = course.derivatives(TIMES)[:3]

    # float resolves 140 s to 8e-6 s, and 6.6 m to 5e-7 m; the first counts times the derivative
    if real == "float":
        limits = 8e-6 * np.array(course.peaks) + 6e-7 * np.abs(exact).max(axis=1)
    else:  # the segments' own error, and that of its derivatives
        limits = np.array([1e-9, 1e-8, 1e-7])
    assert (np.abs(found - exact).max(axis=1) <= limits).all()


@needs_compiler
def test_the_code_says_what_the_code_of_casadi_says(slow: Result, tmp_path: Path) -> None:
    segments = segments_of(slow, "rope")
    t = ca.MX.sym("t")
    piece = ca.low(ca.DM(segments.edges), t)
    row = ca.MX(ca.DM(segments.coefficients.T))[:, piece]
    dt = t - ca.MX(ca.DM(segments.edges))[piece]
    position = ca.MX(0.0)
    for k in range(segments.coefficients.shape[1] - 1, -1, -1):
        position = position * dt + row[k]

    generator = ca.CodeGenerator("theirs.c")
    generator.add(ca.Function("theirs", [t], [position]))
    generator.generate(f"{tmp_path}/")
    source = (tmp_path / "theirs.c").read_text("utf-8")
    theirs_folder = tmp_path / "theirs"
    theirs_folder.mkdir()
    theirs = ca.external("theirs", str(compiled(source, theirs_folder, ("-O1",))))

    ours = compiled(c99.write_source(segments, {}, "double"), tmp_path)
    found = played_in_c(ours, "double", TIMES)[0]
    # both are Horner's form of the same numbers; a compiler may contract a product and a sum
    assert np.abs(found - theirs(TIMES[None]).full().ravel()).max() < 1e-14


@needs_compiler
@pytest.mark.parametrize("signal", ["rope", "angle"])
def test_the_stated_error_of_float_is_that_of_the_compiled_code(
    slow: Result, signal: str, tmp_path: Path
) -> None:
    folder, file = tmp_path / "stored", tmp_path / "float.c"
    folder.mkdir()
    slow.save(folder)
    words = ["export", folder, "--to", "c99", "--real", "float", "--signal", signal]
    assert main([*map(str, words), "--output", str(file)]) == 0
    source = file.read_text("utf-8")
    stated = float(source.split("error = ")[1].split()[0])

    # no sum of a product is contracted, so that each operation is rounded as it is written
    library = compiled(source, tmp_path, (*FLAGS, "-ffp-contract=off"))
    found, course = played_in_c(library, "float", TIMES), source_of(slow).course(signal)
    assert np.array_equal(found, c99.in_float(segments_of(slow, signal), TIMES))
    miss = np.abs(found[0] - course.derivatives(TIMES)[0]).max()
    assert 0.7 * stated < miss <= stated * (1 + 1e-2)  # three digits, of ten times as many times

    # what is asked for and cannot be is refused
    if signal == "rope":
        assert main([*map(str, words), "--error", "1e-9"]) == 2


@needs_compiler
def test_it_rests_outside_its_times(slow: Result, tmp_path: Path) -> None:
    segments = segments_of(slow, "rope")
    library = compiled(c99.write_source(segments, {}, "double"), tmp_path)
    found = played_in_c(library, "double", np.array([-5.0, 0.0, 140.0, 200.0, np.nan]))
    assert np.array_equal(found[:, 0], found[:, 1])
    assert np.array_equal(found[:, 2], found[:, 3])
    assert np.array_equal(found[:, 4], found[:, 1])  # not a number is the start


def test_the_code_calls_nothing(slow: Result) -> None:
    source = c99.write_source(segments_of(slow, "angle"), {}, "float")
    assert "#include" not in source
    assert "malloc" not in source
