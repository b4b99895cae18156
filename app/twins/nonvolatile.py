"""Saving and restoring parameters: 1010h and 1011h (CiA 301, 7.5.2.13 and 7.5.2.14).

"Save" copies the RAM values into the memory and its file; "load" empties the memory, so that defaults are in force
after the next restart.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from typing import Final

from app.model.address import Address
from app.model.datatypes import Raw, encode_raw
from app.model.description import LOAD_SIGNATURE, SAVE_SIGNATURE, Access, Entry
from app.twins.object_store import Cell, Deferred, Effect, Guard, ObjectStore, RefusedAccessError
from app.twins.state_file import Memory, StateFile
from app.wire.sdo import Abort

_LOG: Final = logging.getLogger(__name__)
_SAVE_INDEX: Final = 0x1010
_LOAD_INDEX: Final = 0x1011
_ON_COMMAND: Final = 1
"""What 1010h and 1011h answer when read: bit 0, the device saves (restores) on command."""


class NonVolatile:
    """The memory of one device and the objects that command it.

    ``delivered`` is what the memory holds when there is no file yet. ``duration_ns`` is how long a save takes.
    ``failed`` is called when it could not be written. Where the device does not obey 1010h and 1011h as CiA 301 has it,
    ``commanded`` is False, and the device itself calls ``save`` and ``discard``.
    """

    def __init__(
        self,
        store: ObjectStore,
        file: StateFile | None,
        *,
        duration_ns: int,
        delivered: dict[Address, bytes],
        failed: Callable[[], None] = lambda: None,
        commanded: bool = True,
    ) -> None:
        self._store = store
        self._file = file
        self._duration_ns = duration_ns
        self._failed = failed
        self.slow_ns: int | None = None
        """How long a save takes while the memory is slow; None: it is not."""
        self.failing = False
        """Whether the memory takes nothing."""
        loaded = None if file is None else file.load()
        self.problem = None if loaded is None else loaded.problem
        if loaded is not None and loaded.memory is not None:
            self.memory = loaded.memory
        elif self.problem is not None:
            self.memory = Memory()
        else:
            self.memory = Memory(saved=dict(delivered))
        self._remanent: tuple[Cell, ...] = ()
        self._drop_unknown()
        if commanded:
            self._install(_SAVE_INDEX, SAVE_SIGNATURE, self.save)
            self._install(_LOAD_INDEX, LOAD_SIGNATURE, self.discard)

    def keep_remanent(self, cells: Iterable[Cell]) -> None:
        """Name the values that outlive a restart without being saved, and give them what was kept."""
        self._remanent = tuple(cells)
        kept = {cell.entry.address for cell in self._remanent}
        self._store.restore(lambda entry: entry.address in kept, self.memory.remanent)

    def recall(self, wanted: Callable[[Entry], bool]) -> None:
        """Bring RAM to what a restart finds: saved values, else defaults. Remanent values stay."""
        remanent = {cell.entry.address for cell in self._remanent}
        self._store.restore(
            lambda entry: entry.address not in remanent and wanted(entry),
            self.memory.saved,
        )

    def preset(self, address: Address, data: bytes) -> None:
        """Have a value saved, as if somebody had done it before. Raises OSError."""
        self._write(Memory({**self.memory.saved, address: data}, self.memory.remanent))

    def keep(self) -> None:
        """Write the remanent values to the file, if they changed. Where it fails, ``problem`` says why."""
        now = {cell.entry.address: cell.to_bytes() for cell in self._remanent}
        if now == self.memory.remanent:
            return
        try:
            self._write(Memory(self.memory.saved, now))
        except OSError as error:
            if self._report(str(error)):
                self._failed()

    def forget(self) -> None:
        """Power is gone at this instant: of the remanent values, those that were written remain."""
        kept = {cell.entry.address for cell in self._remanent}
        self._store.restore(lambda entry: entry.address in kept, self.memory.remanent)

    def _drop_unknown(self) -> None:
        """Leave out what the file holds of objects that the description does not have, or has in another size."""
        for values in (self.memory.saved, self.memory.remanent):
            for address, data in list(values.items()):
                cell = self._store.find(address.major, address.minor)
                if cell is None or (cell.size is not None and cell.size != len(data)):
                    del values[address]
                    self._report(f"state of {address} does not fit the description and was left out")

    def _install(self, index: int, signature: int, act: Callable[[Callable[[Entry], bool]], None]) -> None:
        categories = {
            command.address: command.category
            for command in (*self._store.description.save, *self._store.description.load)
        }
        for cell in self._store:
            if cell.entry.address.major != index or cell.entry.address.minor == 0:
                continue
            cell.source = lambda: _ON_COMMAND
            cell.guard = _signature_guard(signature)
            cell.effect = self._effect(act, _selection(categories.get(cell.entry.address)))

    def _effect(self, act: Callable[[Callable[[Entry], bool]], None], wanted: Callable[[Entry], bool]) -> Effect:
        def start(_raw: Raw) -> Deferred:
            duration_ns = self._duration_ns if self.slow_ns is None else self.slow_ns
            return Deferred(duration_ns, lambda _now_ns: act(wanted))

        return start

    def save(self, wanted: Callable[[Entry], bool]) -> None:
        """Copy the wanted RAM values into the memory. Raises RefusedAccessError where it takes nothing."""
        saved = dict(self.memory.saved)
        for cell in self._store:
            entry = cell.entry
            # A live value (a measured temperature in a saved record) and a mirror are no parameters to keep.
            if entry.saved and cell.source is None and _is_parameter(entry) and wanted(entry):
                saved[entry.address] = encode_raw(entry.type, cell.raw)
        self._commit(saved)

    def discard(self, wanted: Callable[[Entry], bool]) -> None:
        """Empty the memory of the wanted values. Raises RefusedAccessError where it takes nothing."""
        saved = self.memory.saved.items()
        self._commit({address: data for address, data in saved if not wanted(self._store.at(address).entry)})

    def _commit(self, saved: dict[Address, bytes]) -> None:
        try:
            self._write(Memory(saved, {cell.entry.address: cell.to_bytes() for cell in self._remanent}))
        except OSError as error:
            self._report(str(error))
            self._failed()
            raise RefusedAccessError(Abort.HARDWARE) from error

    def _report(self, problem: str) -> bool:
        """Tell a problem once; gives whether it is another one than before."""
        if problem == self.problem:
            return False
        self.problem = problem
        _LOG.warning("twin's memory: %s", problem)
        return True

    def _write(self, memory: Memory) -> None:
        """Replace the memory, or leave it as it is and raise OSError."""
        if self.failing:
            raise OSError("the memory takes nothing")
        if self._file is not None:
            self._file.store(memory)
        self.memory = memory


def _is_parameter(entry: Entry) -> bool:
    return entry.access.writable or entry.access is Access.FACTORY


def _signature_guard(signature: int) -> Guard:
    def check(raw: Raw) -> None:
        if raw != signature:
            raise RefusedAccessError(Abort.NOT_STORED)

    return check


def _selection(category: str | None) -> Callable[[Entry], bool]:
    """What a save command covers: all, or the entries of its category and those without one."""
    return lambda entry: category is None or entry.save_category in (None, category)
