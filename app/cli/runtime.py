"""Settings of the Python runtime for a process that serves a bus."""

from __future__ import annotations

import gc
from typing import Final

GC_THRESHOLD: Final = 50_000
"""Objects that may be made, less those that were freed, before garbage is looked for: more than the frames that wait
for the recorder at full load, so that traffic alone never makes the collector walk them."""


def spare_collector() -> None:
    """Take what was loaded so far (descriptions, modules) out of the collector's walks, and let it walk seldom.

    Frames are freed by reference counts; with Python's usual threshold of 700 the collector would walk thousands of
    waiting ones, and all descriptions now and then, to find nothing.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(GC_THRESHOLD, 10, 10)
