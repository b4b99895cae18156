"""For all tests: hypothesis looks for wrong results, not for slow machines."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("hubside", deadline=None)
settings.load_profile("hubside")
