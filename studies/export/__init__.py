"""`antenna-ocp export`: a stored motion in the form that a drive or another program reads.

`command` is the sub-command and `formats` lists the formats. A family of formats is a file, with
writers and the readers that read them back. `round_trip` plays what was read as the drive does.
"""
