"""Margins: what a motor could pull beside what the truss resists, along the whole travel.

`schema` is what the user states, `presets` what a standard states. `resistance` takes a measured
curve, `loads` splits the force into its contributions and multiplies them, `travel` holds the
available force against them, and `figures` draws that.
"""

from studies.margin.schema import MarginRequirements, read_margin

__all__ = ["MarginRequirements", "read_margin"]
