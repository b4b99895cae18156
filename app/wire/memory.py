"""What is known of a node's parameters: in RAM, and in the non-volatile memory that nobody can read.

RAM is what was last read, written and acknowledged, or carried by a PDO; a boot-up makes all of it unknown. Stored is

- PROVEN: the first value read by SDO after the last observed boot-up, before anybody wrote the object, saved or set
  back; a boot-up by the NMT command "reset communication" proves objects 1000h to 1FFFh only;
- SAVED: what stood in RAM at an acknowledged save, or was read after it with no write in between: not yet proven;
- else unknown. A gap in the frames may hide a boot-up, a write or a save: nothing read after it proves anything, until
  the next boot-up. A write of which no end was seen makes RAM unknown.

A write to an object also makes its mirrors (the same quantity at another address) stale.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum
from typing import Any, NamedTuple

from app.model.address import Address, parse_address
from app.model.description import Description
from app.wire.records import Source
from app.wire.sdo_follower import LOAD_INDEX, SAVE_INDEX
from app.wire.stored import COMMUNICATION, covers


class StoredState(Enum):
    """How sure a stored value is."""

    SAVED = "saved"
    PROVEN = "proven"


class Part(Enum):
    """Parts of a dictionary that start anew apart: "reset communication" leaves the application as it is."""

    COMMUNICATION = "communication"
    APPLICATION = "application"


class Reading(NamedTuple):
    """The latest bytes of an object in RAM, when and how they came."""

    data: bytes
    t_ns: int
    source: Source

    def age_ns(self, now_ns: int) -> int:
        """Age at ``now_ns``."""
        return now_ns - self.t_ns


class Stored(NamedTuple):
    """The bytes in non-volatile memory, since when they are known, and how."""

    data: bytes
    t_ns: int
    state: StoredState


class Cell:
    """One object of one node. ``reading`` None: RAM is unknown. ``stale``: frames were lost, or a mirror written."""

    __slots__ = ("address", "bus", "node", "reading", "stale", "stored", "version", "write_epoch")

    def __init__(self, bus: str, node: int, address: Address) -> None:
        self.bus = bus
        self.node = node
        self.address = address
        self.reading: Reading | None = None
        self.stored: Stored | None = None
        self.stale = False
        self.version = 0
        self.write_epoch = -1


class NodeMemory:
    """The cells of one node, and the epochs that tell what a value read proves.

    An epoch begins with each boot-up, save, load and gap. The methods return the cells that changed.
    """

    def __init__(self, bus: str, node: int) -> None:
        self.bus = bus
        self.node = node
        self.cells: dict[Address, Cell] = {}
        self._description: Description | None = None
        self._mirrors: Mapping[Address, tuple[Address, ...]] = {}
        self._epoch = 0
        self._boots: dict[Part, int] = {}
        self._saves: list[tuple[int, Address]] = []
        self._loads: list[tuple[int, Address]] = []

    @property
    def description(self) -> Description | None:
        """What the node is, where known."""
        return self._description

    @description.setter
    def description(self, description: Description | None) -> None:
        self._description = description
        self._mirrors = {} if description is None else _mirrors(description)

    def cell(self, address: Address) -> Cell:
        """The cell of ``address``, made where there is none."""
        cell = self.cells.get(address)
        if cell is None:
            cell = self.cells[address] = Cell(self.bus, self.node, address)
        return cell

    # -- what was seen -----------------------------------------------------------

    def sent(self, cell: Cell, reading: Reading) -> None:
        """The device gave a value by PDO or EMCY: RAM, and no proof of anything stored."""
        cell.reading = reading
        cell.stale = False

    def read(self, cell: Cell, reading: Reading) -> bool:
        """The device gave a value by SDO. True where it differs from what was saved before a restart."""
        cell.reading = reading
        cell.stale = False
        state = self._proof(cell)
        if state is None or (cell.stored is not None and cell.stored.state is state):
            return False
        before, cell.stored = cell.stored, Stored(reading.data, reading.t_ns, state)
        return state is StoredState.PROVEN and before is not None and before.data != reading.data

    def written(self, cell: Cell, reading: Reading) -> list[Cell]:
        """Somebody wrote the object: acknowledged, or by PDO."""
        if cell.address.major in (SAVE_INDEX, LOAD_INDEX):
            return []  # a command: the object does not hold what was written
        repeated = cell.reading is not None and cell.reading.data == reading.data and not cell.stale
        cell.reading = reading
        cell.stale = False
        if repeated and reading.source is Source.PDO_RX:
            return [cell]
        return [cell, *self._touch(cell)]

    def unsure(self, cell: Cell) -> list[Cell]:
        """Somebody may have written the object: nobody saw the end."""
        cell.reading = None
        return [cell, *self._touch(cell)]

    def saved(self, command: Address, t_ns: int) -> list[Cell]:
        """'save' was acknowledged on ``command``."""
        self._epoch += 1
        self._saves.append((self._epoch, command))
        changed = []
        for cell in self.cells.values():
            if covers(self._description, command, cell.address):
                known = cell.reading is not None and not cell.stale
                cell.stored = Stored(cell.reading.data, t_ns, StoredState.SAVED) if known and cell.reading else None
                changed.append(cell)
        return changed

    def save_unsure(self) -> list[Cell]:
        """A save had no end that was seen, or broke: anything may be stored."""
        self._epoch += 1
        self._boots.clear()
        self._saves.clear()
        return _forget_stored(self.cells.values())

    def loaded(self, command: Address) -> list[Cell]:
        """'load' was acknowledged on ``command``: other values are in force after the next restart."""
        self._epoch += 1
        self._loads.append((self._epoch, command))
        return _forget_stored(c for c in self.cells.values() if covers(self._description, command, c.address))

    def boot_up(self, communication_only: bool) -> list[Cell]:
        """The node has started anew, or only its communication has."""
        self._epoch += 1
        parts = (Part.COMMUNICATION,) if communication_only else tuple(Part)
        self._boots.update(dict.fromkeys(parts, self._epoch))
        if not communication_only:
            self._saves.clear()
            self._loads.clear()
        for cell in self.cells.values():
            cell.reading = None
            cell.stale = False
            if cell.stored is not None and cell.stored.state is StoredState.PROVEN and _part(cell.address) in parts:
                cell.stored = None
        return list(self.cells.values())

    def gap(self) -> list[Cell]:
        """Frames are missing."""
        self._epoch += 1
        self._boots.clear()
        self._saves.clear()
        changed = [cell for cell in self.cells.values() if cell.reading is not None and not cell.stale]
        for cell in changed:
            cell.stale = True
        return changed

    # -- reasoning ---------------------------------------------------------------

    def _touch(self, cell: Cell) -> list[Cell]:
        cell.write_epoch = self._epoch
        others = []
        for address in self._mirrors.get(cell.address, ()):
            other = self.cell(address)
            other.write_epoch = self._epoch
            other.stale = other.reading is not None
            others.append(other)
        return others

    def _proof(self, cell: Cell) -> StoredState | None:
        """What a value read now says about the stored one."""
        address, description = cell.address, self._description
        boot = self._boots.get(_part(address))
        if boot is None and not self._saves:
            return None
        if description is not None:
            entry = description.entries.get(address)
            if entry is not None and not entry.saved:
                return None
        since = -1 if boot is None else boot
        if any(epoch > since and covers(description, command, address) for epoch, command in self._loads):
            return None
        saves = [epoch for epoch, command in self._saves if epoch > since and covers(description, command, address)]
        if saves:
            return StoredState.SAVED if cell.write_epoch < saves[-1] else None
        return StoredState.PROVEN if cell.write_epoch < since else None

    # -- keyframes -----------------------------------------------------------------

    def snapshot(self) -> dict[str, Any]:
        """JSON-able state, without the description."""
        return {
            "epoch": self._epoch,
            "boots": {part.value: epoch for part, epoch in self._boots.items()},
            "saves": [[epoch, str(command)] for epoch, command in self._saves],
            "loads": [[epoch, str(command)] for epoch, command in self._loads],
            "cells": {str(address): _cell_snapshot(cell) for address, cell in self.cells.items()},
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from ``snapshot()``. Raises KeyError or ValueError on another state."""
        self._epoch = state["epoch"]
        self._boots = {Part(part): epoch for part, epoch in state["boots"].items()}
        self._saves = [(epoch, parse_address(command)) for epoch, command in state["saves"]]
        self._loads = [(epoch, parse_address(command)) for epoch, command in state["loads"]]
        self.cells = {}
        for text, (reading, stored, stale, write_epoch) in state["cells"].items():
            cell = self.cell(parse_address(text))
            if reading is not None:
                cell.reading = Reading(bytes.fromhex(reading[0]), reading[1], Source(reading[2]))
            if stored is not None:
                cell.stored = Stored(bytes.fromhex(stored[0]), stored[1], StoredState(stored[2]))
            cell.stale = stale
            cell.write_epoch = write_epoch


def _part(address: Address) -> Part:
    return Part.COMMUNICATION if address.major in COMMUNICATION else Part.APPLICATION


def _cell_snapshot(cell: Cell) -> list[Any]:
    reading, stored = cell.reading, cell.stored
    return [
        None if reading is None else [reading.data.hex(), reading.t_ns, reading.source.value],
        None if stored is None else [stored.data.hex(), stored.t_ns, stored.state.value],
        cell.stale,
        cell.write_epoch,
    ]


def _forget_stored(cells: Iterable[Cell]) -> list[Cell]:
    changed = [cell for cell in cells if cell.stored is not None]
    for cell in changed:
        cell.stored = None
    return changed


def _mirrors(description: Description) -> dict[Address, tuple[Address, ...]]:
    """Every address that shows the same quantity as another, with those others."""
    families: dict[Address, list[Address]] = {}
    for entry in description:
        if entry.mirror is not None:
            families.setdefault(entry.mirror.of, [entry.mirror.of]).append(entry.address)
    return {
        address: tuple(other for other in family if other != address)
        for family in families.values()
        for address in family
    }
