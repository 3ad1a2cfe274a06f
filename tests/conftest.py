"""What every test shares: pictures without a display, and reproducible random examples."""

import os

# Before NumPy is loaded: each worker of pytest has a processor of its own.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings

os.environ.setdefault("MPLBACKEND", "Agg")
# tests change what a study calls, which another process would not see
os.environ["ANTENNA_OCP_PROCESSES"] = "1"

settings.register_profile("antenna", derandomize=True, deadline=None, print_blob=False)
settings.load_profile("antenna")

SHORT = ("tests/models/", "tests/ocp/")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put short tests last, so that in the end no worker waits long for another one."""
    items.sort(key=lambda item: [item.nodeid.startswith(folder) for folder in SHORT])
