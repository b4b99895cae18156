"""Settings of the Python runtime: its garbage collector, for commands that start soon and serve a bus."""

from __future__ import annotations

import gc
from typing import Final

GC_THRESHOLD: Final = 50_000
"""Objects that may be made, less those that were freed, before garbage is looked for: more than the frames that wait
for the recorder at full load, so that traffic alone never makes the collector walk them."""


def calm_collector() -> None:
    """Let the collector walk seldom. With Python's usual threshold of 700 loading libraries takes nearly twice as long.

    Frames are freed by reference counts: the collector would walk thousands of waiting ones to find nothing.
    """
    gc.set_threshold(GC_THRESHOLD, 10, 10)


def spare_collector() -> None:
    """Take what was loaded so far (descriptions, modules) out of the collector's walks, and let it walk seldom."""
    calm_collector()
    gc.freeze()
