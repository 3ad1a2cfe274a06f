"""What every test shares: pictures without a display, and reproducible random examples."""

import os

from hypothesis import settings

os.environ.setdefault("MPLBACKEND", "Agg")

settings.register_profile("antenna", derandomize=True, deadline=None, print_blob=False)
settings.load_profile("antenna")
