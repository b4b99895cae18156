"""Settings that were changed for motion and are not put back yet: kept, so that they can be after a server was killed.

They stand in RAM alone: a restart of the device ends them too.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from app.model.address import Address, parse_address
from app.store.small_rows import get_setting, put_setting
from app.store.store import Store

KEY: Final = "motion.left"


class Changed(NamedTuple):
    """An object of a device: what it held, and what was written."""

    was: bytes
    now: bytes


class Left:
    """What was changed, by device. Kept in ``store``; without one as long as the bench. For the event loop."""

    def __init__(self, store: Store | None = None) -> None:
        self._store = store
        kept = None if store is None else store.call(lambda connection: get_setting(connection, KEY))
        self._found = _read(kept)

    @property
    def devices(self) -> tuple[str, ...]:
        """Devices where something was changed."""
        return tuple(self._found)

    def of(self, device: str) -> dict[Address, Changed]:
        """What was changed there, in the order in which it was."""
        return dict(self._found.get(device, {}))

    async def note(self, device: str, address: Address, changed: Changed) -> None:
        """It is about to be written; kept before that. What it held first counts. Raises StoreError."""
        held = self._found.get(device, {}).get(address)
        self._found.setdefault(device, {})[address] = changed if held is None else Changed(held.was, changed.now)
        await self._keep()

    async def forget(self, device: str, address: Address) -> None:
        """It holds again what it held. Raises StoreError."""
        if self._found.get(device, {}).pop(address, None) is None:
            return
        if not self._found[device]:
            del self._found[device]
        await self._keep()

    async def _keep(self) -> None:
        document = _document(self._found)
        if self._store is not None:
            await self._store.run(lambda connection: put_setting(connection, KEY, document))


_Found = dict[str, dict[Address, Changed]]


def _document(found: _Found) -> dict[str, Any]:
    return {
        device: [[address.short, changed.was.hex(), changed.now.hex()] for address, changed in objects.items()]
        for device, objects in found.items()
    }


def _read(document: Any) -> _Found:
    if not isinstance(document, dict):
        return {}
    return {
        device: {parse_address(text): Changed(bytes.fromhex(was), bytes.fromhex(now)) for text, was, now in objects}
        for device, objects in document.items()
    }
