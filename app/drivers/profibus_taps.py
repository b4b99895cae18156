"""Hands out what crosses a PROFIBUS line, as frames with their time."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Final

from app.drivers.contract import FramesCallback
from app.wire.frame import Direction, Fdl, Frame, Stamper

_LOG: Final = logging.getLogger(__name__)
_NS: Final = 1_000_000_000


class Taps:
    """Those who want the frames of ``bus``. Called on the thread of the line; ``subscribe`` from any thread."""

    def __init__(self, bus: str, stamper: Stamper) -> None:
        self._bus = bus
        self._stamper = stamper
        self._lock = threading.RLock()
        self._subscribers: list[FramesCallback] = []

    def subscribe(self, callback: FramesCallback) -> Callable[[], None]:
        """Have every frame handed to ``callback``; once what this gives was called, it is called no more."""
        with self._lock:
            self._subscribers = [*self._subscribers, callback]

        def unsubscribe() -> None:
            with self._lock:
                self._subscribers = [each for each in self._subscribers if each is not callback]

        return unsubscribe

    def __call__(self, direction: Direction, data: bytes, age_s: float) -> None:
        """``data`` ended on the line ``age_s`` ago."""
        (t_ns,) = self._stamper.take_aged((int(age_s * _NS),))
        frame = Frame(t_ns, self._bus, direction, Fdl(data))
        with self._lock:
            for subscriber in self._subscribers:
                try:
                    subscriber([frame])
                except Exception:  # noqa: BLE001 - whatever a subscriber does, the others and the wire go on
                    _LOG.exception("a subscriber of %s failed", self._bus)
