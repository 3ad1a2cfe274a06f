"""`antenna-ocp export`: a stored motion in the form that a drive or another program reads.

`command` has the flags, `work` is what they ask for, and `formats` lists the formats. A family of
formats is a file, with writers and the readers that read them back. `round_trip` plays what was
read as the drive does.
"""

from studies.common.study import Command

COMMAND = Command(
    "the motion of a results folder as a table or polynomials for a drive",
    "studies.export.command",
    "Writes the motion of a result as columns, as the table of a drive, or as polynomials. A "
    "table is read back and played as the given drive does: interpolated, rounded, passed "
    "through its loop and replayed on the truss. Exit code 5 if this exceeds a limit.",
)
