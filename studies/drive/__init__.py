"""The drive behind a profile: what it resolves, how it goes between set-points, what it can bear.

`schema` is what the user states. `course` is the position that the drive has to follow, `setpoints`
samples and rounds it, `interpolation` and `loop` do with the samples what the drive does, and
`playback` says what that is on the truss. `stopping` ends a course early, and goes on from there.
"""

from studies.drive.schema import Drive, read_drive

__all__ = ["Drive", "read_drive"]
