"""What the frames on the wire say of one axis while a test signal runs: courses of a few objects, by t_ns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from threading import Lock
from types import TracebackType
from typing import Any, Final

import numpy as np

from app.model.address import Address
from app.model.values import to_scaled
from app.service.bus_link import BusLink
from app.service.devices import Target, decode
from app.service.motion.signals import Curve
from app.wire.records import Record, Source, ValueSeen

DEMAND: Final = Address(0x607A)
POSITION: Final = Address(0x6064)
FOLLOWING: Final = Address(0x60F4)
VELOCITY: Final = Address(0x606C)
CURRENT: Final = Address(0x6078)
SEEN: Final = (DEMAND, POSITION, FOLLOWING, VELOCITY, CURRENT)
_SENT: Final = (Source.SDO_WRITE, Source.PDO_RX)


class Courses:
    """Hears the bus between ``with`` and its end. The decoder speaks on the driver's receive thread."""

    def __init__(self, link: BusLink, target: Target) -> None:
        self._link = link
        self._target = target
        self._lock = Lock()
        self._seen: dict[Address, list[tuple[int, bytes]]] = {address: [] for address in SEEN}

    def __enter__(self) -> Courses:
        self._link.listen(self._heard)
        return self

    def __exit__(self, _kind: type[BaseException] | None, _e: BaseException | None, _tb: TracebackType | None) -> None:
        self._link.unlisten(self._heard)

    def _heard(self, records: Sequence[Record]) -> None:
        node = self._target.node
        with self._lock:
            for record in records:
                if not isinstance(record, ValueSeen) or record.node != node or record.address not in self._seen:
                    continue
                # Of the target counts what was sent, of all else what the device said.
                if (record.source in _SENT) is (record.address == DEMAND):
                    self._seen[record.address].append((record.t_ns, record.data))

    def of(self, address: Address, from_ns: int) -> tuple[Curve, Curve]:
        """Times in s from ``from_ns`` on, and scaled values."""
        with self._lock:
            seen = [one for one in self._seen[address] if one[0] >= from_ns]
        entry = self._target.entry(address)
        times, values = [], []
        for t_ns, data in seen:
            scaled = to_scaled(entry, decode(entry, data), self._target.lookup)
            if scaled is not None:
                times.append((t_ns - from_ns) / 1e9)
                values.append(float(scaled.number))
        return np.array(times), np.array(values)


def as_document(courses: Iterable[tuple[str, tuple[Curve, Curve]]]) -> dict[str, Any]:
    """Courses to be kept: times in ms, values to a thousandth."""
    return {
        name: {"t_ms": np.round(1000 * times, 1).tolist(), "y": np.round(values, 3).tolist()}
        for name, (times, values) in courses
    }
