"""Finds the devices on a CANopen bus and says what they are.

Every node is asked for its device type (1000h) in waves of a limited width. Who is silent is asked again, with more
patience; who was heard at all (a heartbeat, a late answer) a third time with most. So one time-out loses no node.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple, Protocol

from app.drivers.contract import FoundNode, Identity, ProgressCallback
from app.drivers.sdo_jobs import End, Steps, abort_error
from app.drivers.sdo_transfer import Upload
from app.errors import BusLostError, HubsideError, NoAnswerError, ProtocolError
from app.model.address import Address
from app.model.description import Description

DEVICE_TYPE: Final = Address(0x1000)
DEVICE_NAME: Final = Address(0x1008)
HARDWARE: Final = Address(0x1009)
SOFTWARE: Final = Address(0x100A)
IDENTITY: Final = tuple(Address(0x1018, sub) for sub in (1, 2, 3, 4))
_ASKED: Final = (DEVICE_TYPE, DEVICE_NAME, HARDWARE, SOFTWARE, *IDENTITY)


class Wave(NamedTuple):
    """``width`` questions are open at a time, each for ``timeout_s``."""

    timeout_s: float
    width: int


FIRST: Final = Wave(0.1, 32)
SECOND: Final = Wave(0.3, 64)
HEARD: Final = Wave(1.5, 64)
"""For nodes of which something was heard and that have not answered yet."""


class Asker(Protocol):
    """What a scan needs of the driver."""

    @property
    def nodes_heard(self) -> tuple[int, ...]:
        """Nodes of which any frame was received."""

    async def ask_presence(self, node: int, timeout_s: float) -> bool:
        """Whether ``node`` answers for 1000h."""

    async def read_many(
        self, node: int, addresses: Iterable[Address], timeout_s: float | None = None
    ) -> dict[Address, bytes | HubsideError]:
        """Objects of one node."""


def presence_steps(node: int, timeout_ns: int, results: dict[Address, bytes | HubsideError]) -> Steps[None]:
    """Read 1000h once. A refusal is an answer too."""
    transfer = Upload(DEVICE_TYPE, timeout_ns)
    end = yield transfer
    if end is End.DONE:
        results[DEVICE_TYPE] = transfer.data
    elif end is End.REFUSED:
        results[DEVICE_TYPE] = abort_error(node, DEVICE_TYPE, transfer.abort_code)
    elif end is End.BROKEN:
        results[DEVICE_TYPE] = ProtocolError(bus="", node=node, reason="1000h is no answer of CiA 301")
    elif end is End.LOST:
        raise BusLostError(bus="", node=node, reason="lost while scanning")
    else:
        results[DEVICE_TYPE] = NoAnswerError(node=node, address=str(DEVICE_TYPE), timeout_s=timeout_ns / 1e9)


async def scan(
    asker: Asker, nodes: Sequence[int], descriptions: Sequence[Description], on_progress: ProgressCallback | None = None
) -> list[FoundNode]:
    """The devices among ``nodes``, in ascending order. ``on_progress`` counts nodes that are settled.

    Raises BusLostError; a device that does not answer is no error.
    """
    present: set[int] = set()
    for wave in (FIRST, SECOND):
        silent = [node for node in nodes if node not in present]
        present |= await _ask(asker, silent, wave)
        if on_progress is not None:
            on_progress(len(present), len(nodes))
    heard = [node for node in asker.nodes_heard if node in nodes and node not in present]
    present |= await _ask(asker, heard, HEARD)
    found = await asyncio.gather(*(identify(asker, node, descriptions) for node in sorted(present)))
    if on_progress is not None:
        on_progress(len(nodes), len(nodes))
    return list(found)


async def _ask(asker: Asker, nodes: Sequence[int], wave: Wave) -> set[int]:
    window = asyncio.Semaphore(wave.width)

    async def ask(node: int) -> bool:
        async with window:
            return await asker.ask_presence(node, wave.timeout_s)

    answers = await asyncio.gather(*(ask(node) for node in nodes))
    return {node for node, there in zip(nodes, answers, strict=True) if there}


async def identify(asker: Asker, node: int, descriptions: Sequence[Description]) -> FoundNode:
    """Read 1000h, 1008h, 1009h, 100Ah and 1018h of ``node`` and look for a description that matches."""
    results = await asker.read_many(node, _ASKED, HEARD.timeout_s)
    lost = next((error for error in results.values() if isinstance(error, BusLostError)), None)
    if lost is not None:
        raise lost
    device_type = _number(results[DEVICE_TYPE])
    device_name = _text(results[DEVICE_NAME])
    identity = Identity(*(_number(results[address]) for address in IDENTITY))
    matching = match(descriptions, device_type, device_name, identity)
    return FoundNode(
        node=node,
        device_type=device_type,
        device_name=device_name,
        hardware=_text(results[HARDWARE]),
        software=_text(results[SOFTWARE]),
        identity=identity,
        description_id=None if matching is None else matching.id,
    )


def match(
    descriptions: Sequence[Description], device_type: int | None, device_name: str | None, identity: Identity
) -> Description | None:
    """The description all of whose marks fit; of several the one with most marks, and none without any."""
    best, best_marks = None, 0
    for description in descriptions:
        wanted = description.match
        marks = [
            wanted.device_type is None or wanted.device_type == device_type,
            wanted.device_name is None or (device_name is not None and wanted.device_name in device_name),
            wanted.vendor_id is None or wanted.vendor_id == identity.vendor,
            wanted.product_code is None or wanted.product_code == identity.product,
        ]
        given = (wanted.device_type, wanted.device_name, wanted.vendor_id, wanted.product_code)
        count = sum(1 for mark in given if mark is not None)
        if all(marks) and count > best_marks:
            best, best_marks = description, count
    return best


def _number(result: bytes | HubsideError) -> int | None:
    return int.from_bytes(result, "little") if isinstance(result, bytes) and len(result) <= 4 else None


def _text(result: bytes | HubsideError) -> str | None:
    return result.rstrip(b"\0").decode("latin-1") if isinstance(result, bytes) else None
