"""Builds one index in a process of its own: ``python -m app.recording.index FILE``. For ``app.service.indexing``.

Every line on stdout is JSON: ``{"share": 0.5}`` while it goes on, at last ``{"done": true}``, ``{"cancelled": true}``
or ``{"reason": "..."}``. It gives up, and leaves nothing behind, as soon as its stdin ends.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress

QUIETLY = "--quietly"
_NICE = 10


def _step_back(quietly: bool) -> None:
    """Leave the processor to others; with ``quietly`` to all others. Where the system cannot, it was started so."""
    if hasattr(os, "nice"):
        os.nice(_NICE)
    if quietly and hasattr(os, "SCHED_IDLE"):
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


if __name__ == "__main__":
    _step_back(QUIETLY in sys.argv)  # before anything is loaded
    from app.recording.index.process import run

    sys.exit(run([argument for argument in sys.argv[1:] if argument != QUIETLY]))
