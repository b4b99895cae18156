"""What the process of ``app.recording.index.__main__`` does."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread
from typing import Any

from app.errors import RecordingError
from app.recording.index.build import build_index
from app.recording.index.content import CancelledError
from app.recording.reader import open_recording


def run(arguments: Sequence[str]) -> int:
    """Build the index that the arguments name; the exit code."""
    parser = argparse.ArgumentParser()
    parser.add_argument("recording", type=Path)
    parser.add_argument("--cache", type=Path)
    wanted = parser.parse_args(arguments)
    given_up = Event()
    Thread(target=_wait_for_end, args=(given_up,), daemon=True).start()
    try:
        with open_recording(wanted.recording) as recording:
            descriptions = recording.descriptions
        shown = _Shown()
        build_index(wanted.recording, descriptions, shown.tell, given_up.is_set, wanted.cache).close()
    except CancelledError:
        _say({"cancelled": True})
        return 1
    except RecordingError as error:
        _say({"reason": str(error.details.get("reason", error))})
        return 1
    _say({"done": True})
    return 0


class _Shown:
    """Tells progress, a hundredth at a time."""

    def __init__(self) -> None:
        self._percent = -1

    def tell(self, share: float) -> None:
        percent = int(100 * share)
        if percent > self._percent:
            self._percent = percent
            _say({"share": percent / 100})


def _wait_for_end(given_up: Event) -> None:
    with suppress(OSError):
        while os.read(sys.stdin.fileno(), 1):  # not buffered: a reader that waits in a buffer holds up the end
            pass
    given_up.set()


def _say(line: dict[str, Any]) -> None:
    try:
        print(json.dumps(line), flush=True)
    except OSError:
        """Nobody listens any more; stdin has ended then, too."""
