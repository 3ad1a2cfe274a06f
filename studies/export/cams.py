"""Cam tables: the slave's position over a master's, which here is time in seconds.

Equidistant and free tables and tables with two derivatives as CODESYS SoftMotion declares them,
tables of a TwinCAT PLC, and the file that a MOVI-C controller reads. The manuals are named in
docs/reference/export-formats.md.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

import numpy as np

from ocp.arrays import Array
from studies.common.headers import comments
from studies.drive.setpoints import SetPoints

SEW_POINTS = 1024  # of a table that is joined by lines or cubics, by default
SEW_SPLINE_POINTS = 64  # of one that is joined by a spline
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_XYVA = re.compile(rf"dX := ({_NUMBER}), dY := ({_NUMBER}), dV := ({_NUMBER}), dA := ({_NUMBER})")


def write_codesys_x(points: SetPoints, about: Mapping[str, str], axes: int) -> str:
    """Slave positions at equal distances of the master."""
    return _tabulated(about, points, 1, map(_real, points.positions.tolist()))


def write_codesys_xy(points: SetPoints, about: Mapping[str, str], axes: int) -> str:
    """Pairs of master and slave."""
    return _tabulated(about, points, 2, (f"[{_real(t)}, {_real(x)}]" for t, x in _pairs(points)))


def _tabulated(
    about: Mapping[str, str], points: SetPoints, columns: int, rows: Iterable[str]
) -> str:
    """A table of numbers, with as many of them in a row as there are columns."""
    size = points.times.size
    row = "LREAL" if columns == 1 else f"ARRAY[0..{columns - 1}] OF LREAL"
    return _declared(
        about,
        points,
        by_type=columns,
        size=size,
        kind=f"SMC_CAMTable_LREAL_{size}_{columns}",
        fields=[f"Table : ARRAY[0..{size - 1}] OF {row};"],
        value=f"(Table := [{', '.join(rows)}])",
    )


def write_codesys_xyva(points: SetPoints, about: Mapping[str, str], axes: int) -> str:
    """Master, slave, and its first and second derivative, which a quintic polynomial joins."""
    rows = zip(
        points.times.tolist(),
        points.positions.tolist(),
        points.velocities.tolist(),
        points.accelerations.tolist(),
        strict=True,
    )
    body = ",\n        ".join(
        f"(dX := {_real(t)}, dY := {_real(x)}, dV := {_real(v)}, dA := {_real(a)})"
        for t, x, v, a in rows
    )
    size = points.times.size
    kind = f"ARRAY[0..{size - 1}] OF SMC_CAMXYVA"
    return _declared(
        about, points, by_type=3, size=size, kind=kind, fields=[], value=f"[\n        {body}]"
    )


def _declared(
    about: Mapping[str, str],
    points: SetPoints,
    by_type: int,
    size: int,
    kind: str,
    fields: list[str],
    value: str,
) -> str:
    """A list of global variables in structured text, and the type of the table where it has one."""
    scales = ("EditorMaster", "EditorSlave", "TableMaster", "TableSlave")
    type_of = [
        f"TYPE {kind} : STRUCT",
        *(f"    {field}" for field in fields),
        *(f"    f{scale}{end} : REAL;" for scale in scales for end in ("Min", "Max")),
        "END_STRUCT END_TYPE",
    ]

    # equal ranges in editor and table are no scaling
    ranges = {"Master": points.times, "Slave": points.positions}
    scaling = ", ".join(
        f"f{scale}Min := {_real(float(row.min()))}, f{scale}Max := {_real(float(row.max()))}"
        for scale in scales
        for row in [ranges[scale.removeprefix("Editor").removeprefix("Table")]]
    )
    if fields:
        value = f"{value[:-1]}, {scaling})"

    variable = 6 if fields else 0  # 6: LREAL
    lines = [
        *comments(about, "// "),
        *(type_of if fields else []),
        "VAR_GLOBAL",
        f"    DeploymentPoints : {kind} := {value};",
        f"    Deployment : MC_CAM_REF := (byType := {by_type}, byVarType := {variable}, "
        f"nElements := {size}, xStart := {_real(float(points.times[0]))}, "
        f"xEnd := {_real(float(points.times[-1]))});",
        "END_VAR",
        "// once, before the cam is selected: Deployment.pce := ADR(DeploymentPoints);",
    ]
    return "\n".join(lines) + "\n"


def read_codesys_x(text: str, count: float | None) -> SetPoints:
    """Read what `write_codesys_x` wrote."""
    positions = _numbers(text, r"Table := \[([^\]]*)\]")
    end = float(_found(rf"xEnd := ({_NUMBER})", text))
    return _bare(np.linspace(0.0, end, positions.size), positions)


def read_codesys_xy(text: str, count: float | None) -> SetPoints:
    """Read what `write_codesys_xy` wrote."""
    pairs = _numbers(text, r"Table := \[(\[.*?\])\]").reshape(-1, 2)
    return _bare(pairs[:, 0], pairs[:, 1])


def read_codesys_xyva(text: str, count: float | None) -> SetPoints:
    """Read what `write_codesys_xyva` wrote."""
    rows = np.array([[float(cell) for cell in row] for row in _XYVA.findall(text)]).T
    return SetPoints(rows[0], rows[1], rows[2], rows[3])


def write_beckhoff(points: SetPoints, about: Mapping[str, str], axes: int) -> str:
    """A two-dimensional array of master and slave positions, and the MC_CAM_REF that points to it.

    The steps are called equal where they are.
    """
    rows = ",\n        ".join(f"{_real(t)}, {_real(x)}" for t, x in _pairs(points))
    size = points.times.size
    even = points.longest - points.shortest < 1e-9 * points.longest
    kind = "MC_TABLETYPE_EQUIDISTANT" if even else "MC_TABLETYPE_NONEQUIDISTANT"
    lines = [
        *comments(about, "// "),
        "VAR_GLOBAL",
        f"    DeploymentTable : ARRAY[0..{size - 1}, 0..1] OF LREAL := [\n        {rows}];",
        f"    Deployment : MC_CAM_REF := (TableType := {kind}, NoOfRows := {size}, "
        "NoOfColumns := 2);",
        "END_VAR",
        "// once, before the table is selected: Deployment.pArray := ADR(DeploymentTable);",
        "// and Deployment.ArraySize := SIZEOF(DeploymentTable);",
    ]
    return "\n".join(lines) + "\n"


def read_beckhoff(text: str, count: float | None) -> SetPoints:
    """Read what `write_beckhoff` wrote."""
    pairs = _numbers(text, r"OF LREAL := \[([^\]]*)\]").reshape(-1, 2)
    return _bare(pairs[:, 0], pairs[:, 1])


def write_sew(points: SetPoints, about: Mapping[str, str], axes: int) -> str:
    """The number of points, then master and slave of each, with a tab between."""
    rows = [f"{_real(t)}\t{_real(x)}" for t, x in _pairs(points)]
    return "\n".join([str(points.times.size), *rows]) + "\n"


def read_sew(text: str, count: float | None) -> SetPoints:
    """Read what `write_sew` wrote."""
    head, *lines = text.splitlines()
    rows = np.array([[float(cell) for cell in line.split("\t")] for line in lines[: int(head)]])
    return _bare(rows[:, 0], rows[:, 1])


def _pairs(points: SetPoints) -> list[tuple[float, float]]:
    return list(zip(points.times.tolist(), points.positions.tolist(), strict=True))


def _real(value: float) -> str:
    """A literal of structured text, which needs a decimal point."""
    text = f"{value:.15g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        return f"{mantissa if '.' in mantissa else mantissa + '.0'}E{int(exponent)}"
    return text if "." in text else f"{text}.0"


def _found(pattern: str, text: str) -> str:
    match = re.search(pattern, text, re.S)
    assert match is not None  # the text is what a writer beside this reader wrote
    return match[1]


def _numbers(text: str, pattern: str) -> Array:
    return np.array([float(item) for item in re.findall(_NUMBER, _found(pattern, text))])


def _bare(times: Array, positions: Array) -> SetPoints:
    still = np.zeros_like(times)
    return SetPoints(times, positions, still, still)
