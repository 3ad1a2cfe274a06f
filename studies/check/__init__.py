"""Anyone's profile: read, its noise smoothed, and held against caps, models and optima."""
