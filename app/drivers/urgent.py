"""What is commanded urgently (STOP, FEATHER), and the writes that it forbids.

A write that waits while an urgent command goes to the same object must not follow it: it would take the command back.
So every write says how many commands it knows of, and leaves only while there was no further one.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import Lock

from app.model.address import Address


class UrgentCommands:
    """How often each object of each node was commanded urgently. Callable from any thread."""

    def __init__(self) -> None:
        self._lock = Lock()
        """Held while a write that may still go is handed to the adapter: a command is counted before it or after it."""
        self._counts: dict[tuple[int, Address], int] = {}

    def count(self, node: int, address: Address) -> int:
        """How many there were so far."""
        return self._counts.get((node, address), 0)

    def note(self, node: int, address: Address) -> int:
        """One is about to be sent; gives its number. From now on no write leaves any more that did not know of it.

        Nor does an earlier command: with its own number as what it knows, it gives way to the newer one.
        """
        with self._lock:
            number = self._counts[node, address] = self.count(node, address) + 1
        return number

    def send_unless(self, node: int, address: Address, known: int, send: Callable[[], None]) -> bool:
        """Call ``send`` and give True; False, and nothing is sent, where there were more commands than ``known``."""
        with self._lock:
            if self.count(node, address) != known:
                return False
            send()
        return True
