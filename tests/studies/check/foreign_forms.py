"""Files as instruments, simulations and spreadsheets write them, rebuilt in small.

Each form is the text of a file, or a function that writes one. All hold the same motion: times in
seconds and angles, with at least six digits. What stands around them is as the named program writes
it, with its own names, units, blocks and separators.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

from models.laws import JerkLimited
from models.truss import TrussParameters
from studies.truss.config import DEPLOYED

TRUSS = TrussParameters()
LAW = JerkLimited(60.0, TRUSS.stowed_angle, DEPLOYED, 200 / 60.0**3)
TIME = np.round(np.linspace(0.0, 60.0, 121), 6)
RAD = LAW.motion(TIME).angle
DEG = np.degrees(RAD)
VOLT = 0.5 + 0 * TIME


def lines(
    *columns: Iterable[Any],
    between: str = ",",
    decimal: str = ".",
    form: str = "{:.8f}",
    before: str = "",
    behind: str = "",
) -> str:
    def cell(value: Any) -> str:
        return value if isinstance(value, str) else form.format(value).replace(".", decimal)

    rows = (between.join(map(cell, row)) for row in zip(*columns, strict=True))
    return "".join(f"{before}{row}{behind}\n" for row in rows)


LVM = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t{decimal}
Multi_Headings\tNo
X_Columns\tOne
Time_Pref\tAbsolute
Operator\tlab
Date\t2025/03/11
Time\t10:12:44{decimal}1250000
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t121\t121\t
Date\t2025/03/11\t2025/03/11\t
Time\t10:12:44{decimal}125\t10:12:44{decimal}125\t
Y_Unit_Label\tdeg\tVolts\t
X_Dimension\tTime\tTime\t
X0\t0{decimal}0000000000000000E+0\t0{decimal}0000000000000000E+0\t
Delta_X\t0{decimal}500000\t0{decimal}500000\t
***End_of_Header***\t\t\t
X_Value\t{name}\tSupply\tComment
"""

TEK_BLOCK = (
    ("Record Length", "1.210000e+02", ""),
    ("Sample Interval", "5.000000e-01", ""),
    ("Trigger Point", "0.000000e+00", ""),
    ("", "", ""),
    ("Source", "CH1", ""),
    ("Vertical Units", "V", ""),
    ("Vertical Scale", "5.000000e-01", ""),
    ("Horizontal Units", "s", ""),
    ("Model Number", "TDS2024C", ""),
)


def tektronix_old() -> str:
    """Settings beside the first rows, no header, and a comma at the end."""
    settings = [*TEK_BLOCK, *[("", "", "")] * (TIME.size - len(TEK_BLOCK))]
    keys, values, more = zip(*settings, strict=True)
    return lines(keys, values, more, TIME, RAD, behind=",", form="{:013.9f}")


TEK_NEW = """Model,MSO46
Firmware Version,2.0.3
Waveform Type,ANALOG
Point Format,Y
Horizontal Units,s
Horizontal Scale,6
Sample Interval,0.5
Record Length,121
Vertical Units,{unit}
Vertical Offset,0
Label,encoder
,
TIME,{name}
"""

OPENSIM = """{name}
version=1
nRows=121
nColumns=3
inDegrees={degrees}

Units are S.I. units (second, meters, Newtons, ...)
If the header above contains a line with 'inDegrees', this indicates whether rotational values are
in degrees (yes) or radians (no).

endheader
time\t{angle}\tlumbar_bending
"""

TWINCAT = (
    "Name;Scope YT Project;;\nFile;C:\\TwinCAT\\deploy.svdx;;\nStarttime of export;"
    "133860276400000000;11.03.2025 10:12:44;\nEndtime of export;133860277000000000;"
    "11.03.2025 10:13:44;\n;;;\nName;Axis 1.ActPos;Name;Axis 1.ActTorque\n"
    "SymbolComment;;SymbolComment;\nData-Type;REAL64;Data-Type;REAL64\n"
    "SampleTime[ms];500;SampleTime[ms];500\nUnit;°;Unit;Nm\n"
)

ADAMS = """! ADAMS/View plot data
!
A. .deploy.plot_1:

 Time            MEA_ANGLE        MEA_FORCE
 (sec)           (deg)            (newton)

"""

ADAMS_QUOTED = '"TIME"\t".deploy.crank.MEA_PT2PT_1.Q"\n'

CANOE = """// CANoe 16.0 measurement export
// Begin: 11.03.2025 10:12:44
Time[s];Drive::Status::ActAngle[deg];Drive::Status::Temp[degC]
"""


def canoe_sparse() -> str:
    """A row for each message: a signal has no value where another one was sent."""
    rows = []
    for t, angle in zip(TIME, DEG, strict=True):
        rows.append(f"{t:.6f};{angle:.8f};")
        rows.append(f"{t + 0.11:.6f};;{23.5:.1f}")
    return "Time;ActAngle;Temp\n" + "\n".join(rows) + "\n"


def canalyzer() -> str:
    """Decimal commas, and the unit in a row of its own."""
    head = "Zeit;Antrieb.Istwinkel\n[s];[°]\n"
    return head + lines(TIME, DEG, between=";", decimal=",")


def spreadsheet_clock() -> str:
    """Times of day."""
    clock = [f"10:{int(12 + t // 60):02d}:{t % 60:06.3f}" for t in TIME]
    return "Uhrzeit;Winkel [°]\n" + lines(clock, DEG, between=";", decimal=",")


def ros_bag() -> str:
    """`rostopic echo -p`: times in nanoseconds since 1970, and many other fields."""
    stamps = [str(1741687964125000000 + round(1e9 * t)) for t in TIME]
    numbers = [str(k) for k in range(TIME.size)]
    zeros = 0 * TIME
    head = "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.position0\n"
    # the fourth field is an empty text
    return head + lines(stamps, numbers, stamps, [""] * zeros.size, RAD)


def _book(rows: Iterable[Iterable[Any]]) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        from openpyxl import Workbook

        book = Workbook()
        for row in rows:
            book.active.append(list(row))
        book.save(path)

    return write


def _pairs(*columns: Any) -> list[tuple[Any, ...]]:
    return list(zip(*(list(column) for column in columns), strict=True))


def _commas(values: Any) -> list[str]:
    return [f"{value:.8f}".replace(".", ",") for value in values]


def simulink_structure(path: Path) -> None:
    """`Structure With Time` of a To Workspace block."""
    signals = {"values": RAD[:, None], "dimensions": 1.0, "label": "alpha"}
    savemat(path, {"tout": TIME, "simout": {"time": TIME, "signals": signals}})


def simulink_matrix(path: Path) -> None:
    """A To File block: times in the first row, signals below."""
    savemat(path, {"ans": np.vstack([TIME, RAD, VOLT])})


INDEX = [str(k) for k in range(TIME.size)]

# name of a form: the file, and its content
FORMS: dict[str, tuple[str, str | Callable[[Path], None]]] = {
    "LabVIEW": (
        "a.lvm",
        LVM.format(decimal=".", name="Angle") + lines(TIME, DEG, VOLT, between="\t"),
    ),
    "LabVIEW, decimal commas, a name of its own": (
        "a.lvm",
        LVM.format(decimal=",", name="Geber 3") + lines(TIME, DEG, VOLT, between="\t", decimal=","),
    ),
    "Tektronix, old": ("T0001.CSV", tektronix_old()),
    "Tektronix, new": (
        "tek0001.csv",
        TEK_NEW.format(unit="V", name="CH1") + lines(TIME - 30, RAD, form="{:.9e}"),
    ),
    "Tektronix, mathematical channel in degrees": (
        "tek0002.csv",
        TEK_NEW.format(unit="deg", name="MATH1") + lines(TIME, DEG, form="{:.9e}"),
    ),
    "Keysight": ("scope_0.csv", "x-axis,1,2\nsecond,Volt,Volt\n" + lines(TIME, RAD, VOLT)),
    "Keysight, labelled": (
        "scope_1.csv",
        "x-axis,encoder\nsecond,degree\n" + lines(TIME - 5, DEG, form="{:+.9E}"),
    ),
    "CANoe": ("log.csv", CANOE + lines(TIME, DEG, 23.5 + VOLT, between=";")),
    "CANoe, a row for each message": ("log.csv", canoe_sparse()),
    "CANalyzer": ("log.csv", canalyzer()),
    "ADAMS table": ("a.tab", ADAMS + lines(TIME, DEG, VOLT, between="   ", before="   ")),
    "ADAMS, quoted names": (
        "a.tab",
        ADAMS_QUOTED + lines(TIME, DEG, between="\t", form="{:.8E}"),
    ),
    "OpenSim .mot in degrees": (
        "a.mot",
        OPENSIM.format(name="Coordinates", degrees="yes", angle="knee_angle_r")
        + lines(TIME, DEG, VOLT, between="\t", before="      "),
    ),
    "OpenSim .sto in radians": (
        "a.sto",
        OPENSIM.format(name="ModelCoordinates", degrees="no", angle="/jointset/crank/angle/value")
        + lines(TIME, RAD, VOLT, between="\t"),
    ),
    "TwinCAT scope": (
        "scope.csv",
        TWINCAT + lines(1e3 * TIME, DEG, 1e3 * TIME, VOLT, between=";"),
    ),
    "TwinCAT scope, decimal commas and tabs": (
        "scope.txt",
        TWINCAT.replace(";", "\t")
        + lines(1e3 * TIME, DEG, 1e3 * TIME, VOLT, between="\t", decimal=","),
    ),
    "Simulink, structure with time": ("a.mat", simulink_structure),
    "Simulink, matrix of a To File block": ("a.mat", simulink_matrix),
    "Simulink data inspector": (
        "sdi.csv",
        "time,alpha:1,supply\n,Unit: deg,Unit: V\n" + lines(TIME, DEG, VOLT),
    ),
    "ROS, rostopic echo": ("topic.csv", ros_bag()),
    "ROS, PlotJuggler": (
        "plot.csv",
        "__time,/joint_states/hinge/position,/joint_states/hinge/effort\n"
        + lines(TIME + 1741687964.125, RAD, VOLT, form="{:.9f}"),
    ),
    "pandas, index without a name": (
        "frame.csv",
        ",time_s,angle_deg\n" + lines(INDEX, TIME, DEG),
    ),
    "spreadsheet, index and names of its own": (
        "sheet.csv",
        "No.;Stempel;Geber\n" + lines(INDEX, TIME, DEG, between=";", decimal=","),
    ),
    "spreadsheet, row of units": (
        "sheet.csv",
        "Test 7;;\n;;\nt;Winkel;Strom\ns;°;A\n" + lines(TIME, DEG, VOLT, between=";", decimal=","),
    ),
    "spreadsheet, header with commas above semicolons": (
        "sheet.csv",
        "time (s), theta [deg]\n" + lines(TIME, DEG, between=";", decimal=","),
    ),
    "spreadsheet, times of day": ("sheet.csv", spreadsheet_clock()),
    "spreadsheet, quoted numbers": (
        "sheet.csv",
        '"Time [s]","Angle [deg]"\n'
        + lines([f'"{t:.6f}"' for t in TIME], [f'"{x:.8f}"' for x in DEG]),
    ),
    "Excel, texts with decimal commas": (
        "sheet.xlsx",
        _book([("Zeit [s]", "Winkel [°]"), *_pairs(_commas(TIME), _commas(DEG))]),
    ),
    "Excel, index, titles and a row of units": (
        "sheet.xlsx",
        _book(
            [
                ("Deployment", None, None),
                (None, None, None),
                ("#", "Time", "alpha"),
                (None, "s", "deg"),
                *_pairs(range(TIME.size), TIME, DEG),
            ]
        ),
    ),
    "Excel, names of its own": (
        "sheet.xlsx",
        _book([("Messung", "Stempel", "Geber 3"), *_pairs(INDEX, TIME, DEG)]),
    ),
}


def write_form(name: str, folder: Path) -> Path:
    """The file of a form in a folder."""
    file, content = FORMS[name]
    path = folder / file
    if isinstance(content, str):
        path.write_bytes(content.encode("cp1252" if "°" in content else "utf-8"))
    else:
        content(path)
    return path
