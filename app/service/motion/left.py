"""What was changed for motion and is not put back yet: kept, so that it can be after a server was killed.

Settings stand in RAM alone: a restart of the device ends them too, and its NMT state and mode of operation with them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from app.model.address import Address, parse_address
from app.store.small_rows import get_setting, put_setting
from app.store.store import Store
from app.wire.nmt import NmtState

KEY: Final = "motion.left"
_EMERGENCY_DRIVE: Final = 1
"""Profile position: a drive to feather leaves it behind (OAT manual, external EFC)."""


class Changed(NamedTuple):
    """An object of a device: what it held, and what was written."""

    was: bytes
    now: bytes


class ModeChanged(NamedTuple):
    """The mode of operation (6061h) of an axis before it was prepared, and the one that was set last."""

    was: int
    now: int

    def stands(self, shown: int) -> bool:
        """The axis is in the mode that was set last, or in that of an emergency drive since, not in somebody else's."""
        return shown in (self.now, _EMERGENCY_DRIVE)


@dataclass
class _Found:
    objects: dict[Address, Changed] = field(default_factory=dict)
    nmt: NmtState | None = None
    mode: ModeChanged | None = None


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
        found = self._found.get(device)
        return {} if found is None else dict(found.objects)

    def nmt_of(self, device: str) -> NmtState | None:
        """The NMT state that the node had before it was started for motion; None where it was not."""
        found = self._found.get(device)
        return None if found is None else found.nmt

    def mode_of(self, device: str) -> ModeChanged | None:
        """The mode of the axis before it was prepared, and now; None where it has its own again."""
        found = self._found.get(device)
        return None if found is None else found.mode

    async def note(self, device: str, address: Address, changed: Changed) -> None:
        """It is about to be written; kept before that. What it held first counts. Raises StoreError."""
        objects = self._found.setdefault(device, _Found()).objects
        held = objects.get(address)
        objects[address] = changed if held is None else Changed(held.was, changed.now)
        await self._keep()

    async def note_nmt(self, device: str, state: NmtState) -> None:
        """The node is about to be started; it was in ``state``. The first one counts. Raises StoreError."""
        found = self._found.setdefault(device, _Found())
        found.nmt = found.nmt or state
        await self._keep()

    async def note_mode(self, device: str, mode: int) -> None:
        """The axis is about to be prepared and is in ``mode``. Raises StoreError.

        What an earlier preparation noted counts as long as its mode stands: another one is of somebody else, or of the
        time after a restart.
        """
        found = self._found.setdefault(device, _Found())
        if found.mode is None or not found.mode.stands(mode):
            found.mode = ModeChanged(mode, mode)
            await self._keep()

    async def note_mode_set(self, device: str, mode: int) -> None:
        """The mode of an axis that is being prepared, or is, is about to be set. Raises StoreError."""
        found = self._found.get(device)
        if found is not None and found.mode is not None:
            found.mode = ModeChanged(found.mode.was, mode)
            await self._keep()

    async def forget(self, device: str, address: Address) -> None:
        """It holds again what it held. Raises StoreError."""
        if device in self._found and self._found[device].objects.pop(address, None) is not None:
            await self._tidy(device)

    async def forget_nmt(self, device: str) -> None:
        """The node has its NMT state again. Raises StoreError."""
        if device in self._found:
            self._found[device].nmt = None
            await self._tidy(device)

    async def forget_mode(self, device: str) -> None:
        """The axis has its mode again. Raises StoreError."""
        if device in self._found:
            self._found[device].mode = None
            await self._tidy(device)

    async def _tidy(self, device: str) -> None:
        found = self._found[device]
        if not found.objects and found.nmt is None and found.mode is None:
            del self._found[device]
        await self._keep()

    async def _keep(self) -> None:
        document = {device: _document(found) for device, found in self._found.items()}
        if self._store is not None:
            await self._store.run(lambda connection: put_setting(connection, KEY, document))


def _document(found: _Found) -> dict[str, Any]:
    objects = [[address.short, changed.was.hex(), changed.now.hex()] for address, changed in found.objects.items()]
    return {"objects": objects, "nmt": None if found.nmt is None else found.nmt.name, "mode": found.mode}


def _read(document: Any) -> dict[str, _Found]:
    if not isinstance(document, dict):
        return {}
    return {
        device: _Found(
            {
                parse_address(text): Changed(bytes.fromhex(was), bytes.fromhex(now))
                for text, was, now in found["objects"]
            },
            None if found["nmt"] is None else NmtState[found["nmt"]],
            None if found.get("mode") is None else ModeChanged(*found["mode"]),
        )
        for device, found in document.items()
    }
