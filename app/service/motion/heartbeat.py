"""Our heartbeat on one bus, as long as an axis watches it (CiA 301, 7.2.8.3.2.2).

It is sent by the same turn of the event loop that looks after the dead man: what holds up the one holds up the other,
and the drives stop by themselves.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, Final

from app.errors import HubsideError

log = logging.getLogger(__name__)

PERIOD_S: Final = 0.08


class Heartbeat:
    """The heartbeat as ``node`` on the bus of ``driver``."""

    def __init__(self, driver: Any, node: int, monotonic_s: Callable[[], float]) -> None:
        self.node = node
        self._driver = driver
        self.now_s = monotonic_s
        self._watching: set[str] = set()
        self._withheld: set[str] = set()
        self._cut = False
        self._last_s = 0.0

    @property
    def seen(self) -> bool:
        """A device of that number is on the bus already."""
        return self.node in self._driver.nodes_heard

    def watch(self, device: str) -> None:
        """``device`` watches us from now on: the first heartbeat goes at once."""
        self._cut = self._cut and bool(self._watching - {device})
        self._watching.add(device)
        self._withheld.discard(device)
        if not self._cut:
            self._send()

    def forget(self, device: str) -> None:
        """``device`` does not watch us any more."""
        self._watching.discard(device)
        self._withheld.discard(device)
        self._cut = self._cut and bool(self._watching)

    def cut(self) -> bool:
        """The link was lost: no heartbeat any more until no device watches us, for drives that stop shall stay so.

        True where a device watches us and it is cut only now.
        """
        news = bool(self._watching) and not self._cut
        self._cut = self._cut or news
        return news

    def withhold(self, device: str) -> float:
        """Be silent; when the last heartbeat was sent, in s of the monotonic clock."""
        self._withheld.add(device)
        return self._last_s

    def go_on(self, device: str) -> None:
        """Be silent no longer."""
        self._withheld.discard(device)
        self.tick()

    def tick(self) -> None:
        """Send when it is time."""
        if self._watching and not self._withheld and not self._cut and self.now_s() - self._last_s >= PERIOD_S:
            self._send()

    @property
    def watched(self) -> bool:
        """A device can watch us on this bus."""
        return True

    def _send(self) -> None:
        try:
            self._driver.beat(self.node)
        except HubsideError as error:  # the link is gone: the drives stop by themselves
            log.debug("heartbeat: %s", error.code)
            return
        self._last_s = self.now_s()


class NoHeartbeat(Heartbeat):
    """A bus without heartbeats: it is known which axes are prepared, and whether the link was lost since."""

    def __init__(self, monotonic_s: Callable[[], float]) -> None:
        super().__init__(None, 0, monotonic_s)

    @property
    def watched(self) -> bool:
        """No device can."""
        return False

    @property
    def seen(self) -> bool:
        """Nobody has its number."""
        return False

    def _send(self) -> None:
        self._last_s = self.now_s()
