"""For all tests: hypothesis looks for wrong results, not for slow machines; a machine may stand still."""

from __future__ import annotations

from hypothesis import settings

from tests.standstill import (
    pytest_collection_modifyitems,
    pytest_runtest_setup,
    pytest_sessionfinish,
    pytest_sessionstart,
)

__all__ = [
    "pytest_collection_modifyitems",
    "pytest_runtest_setup",
    "pytest_sessionfinish",
    "pytest_sessionstart",
]

settings.register_profile("hubside", deadline=None)
settings.load_profile("hubside")
