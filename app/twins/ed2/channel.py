"""One axis as the bus sees it: its parameters and their memory, its PKW jobs, its process data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from app.model.address import Address
from app.model.datatypes import Raw, decode_raw
from app.model.description import Description
from app.twins.ed2.delivered import SIGNALS, delivered, pkw
from app.twins.ed2.pkw_server import PkwServer, ReadMore
from app.twins.nonvolatile import NonVolatile
from app.twins.object_store import ObjectStore, RefusedAccessError
from app.twins.state_file import StateFile
from app.wire.profibus import pkw as pkw_codec
from app.wire.profibus.pzd import Order, decode_pzd, encode_pzd
from app.wire.profibus.telegrams import Signal, TelegramType

SAVE_NS: Final = 300_000_000
"""What a save takes (assumed)."""


class Channel:
    """One axis. ``special`` are parameters that are more than a value; ``live`` tells signals of process data."""

    def __init__(
        self,
        description: Description,
        axis: int,
        transducer: int,
        state: Path | None,
        special: Mapping[Address, ReadMore],
        live: Callable[[Signal], int],
    ) -> None:
        self._transducer = transducer
        self.store = ObjectStore(description, node_id=0)
        file = None if state is None else StateFile(state, f"{description.id}/axis-{axis}")
        self._delivered = delivered(description, transducer, axis)
        self.memory = NonVolatile(
            self.store,
            file,
            duration_ns=SAVE_NS,
            delivered=self._delivered,
            commanded=False,
        )
        self.pkw = PkwServer(self.store, special, self._written)
        self.changed = True
        """A parameter was written since somebody looked."""
        self.telegram: TelegramType | None = None
        self.received: dict[Signal, int] = {}
        """Process data from the master that are in force."""
        self._live = live
        self.recall()

    def recall(self) -> None:
        """Power-on: RAM is what was saved, else the defaults."""
        self.memory.recall(lambda _entry: True)
        self._make_sound()
        # OPEN: listed as lost without power (4.4). Then it can only be that of the hardware when power comes back.
        self.store.at(pkw(1, 97)).raw = SIGNALS[self._transducer]
        self.pkw.reset()
        self.received, self.changed = {}, True

    def _make_sound(self) -> None:
        """Where the memory holds no value of an enumeration, the one of delivery stands: none has a printed default."""
        for address, data in self._delivered.items():
            cell = self.store.at(address)
            names = self.store.description.enumeration_of(cell.entry, lambda other: self.store.at(other).now)
            if names is None:
                continue
            known = any(one.value == cell.raw for one in names.values)
            if address not in self.memory.memory.saved or not known:
                cell.raw = decode_raw(cell.entry.type, data)

    def _written(self) -> None:
        self.changed = True

    # -- process data ------------------------------------------------------------------------

    def outputs(self, t_ns: int, data: bytes, order: Order) -> dict[Signal, int]:
        """Take the telegram from the master; gives its process data."""
        telegram = self.telegram
        assert telegram is not None  # a configuration came before
        head = pkw_codec.SIZE if telegram.has_pkw else 0
        if head:
            self.pkw.ask(t_ns, data[:head])
        return decode_pzd(telegram.received, data[head:], order)

    def inputs(self, order: Order) -> bytes:
        """The telegram to the master."""
        telegram = self.telegram
        assert telegram is not None  # a configuration came before
        values = {signal: self._live(signal) for shared in telegram.sent for signal in shared}
        return (self.pkw.answer if telegram.has_pkw else b"") + encode_pzd(telegram.sent, values, order)

    # -- parameters --------------------------------------------------------------------------

    def number(self, ind: int, pnu: int) -> int:
        """A parameter's value."""
        return self.store.number(ind, pnu)

    def offer(self, ind: int, pnu: int, raw: Raw) -> bool:
        """Write a parameter by process data; False where it is refused, and then the old value stays."""
        cell = self.store.at(pkw(ind, pnu))
        if cell.raw == raw:
            return True
        try:
            self.store.assign(cell, raw)
        except RefusedAccessError:
            return False
        self.changed = True
        return True

    def put(self, ind: int, pnu: int, raw: int) -> None:
        """Give a parameter its value, whatever conditions it has."""
        self.store.cell(ind, pnu).raw = raw
        self.changed = True

    def show(self, ind: int, pnu: int, source: Callable[[], int]) -> None:
        """Let a parameter tell a live value."""
        self.store.cell(ind, pnu).source = source
