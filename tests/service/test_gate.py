"""The gate: a device of an unfinished restore is known under every name and on every adapter."""

from __future__ import annotations

import pytest

from app.errors import RestoreOpenError
from app.model.sets import Identity
from app.model.site import Device
from app.service.gate import Block, Blocks, Gate, Place, adapter_of

OURS = Identity(vendor_id=7, product_code=1, serial=4711)
SILENT = Identity()
ADAPTER = "socketcand:127.0.0.1:29536/can0"


def device(slug: str, node: int = 11) -> Device:
    return Device(slug, "PMC", "oat-pmc", "can0", node)


def gate(*blocks: Block, adapter: str = ADAPTER) -> Gate:
    return Gate({"can0": adapter}, Blocks(blocks))


def block(station: str = "wtg-07/blade-1", identity: Identity = OURS, adapter: str = ADAPTER) -> Block:
    return Block("r1", station, ((Place(adapter_of(adapter), 11), identity),))


async def is_shut(to: Gate, which: Device, identity: Identity) -> bool:
    async def ask() -> Identity:
        return identity

    try:
        await to.check(which, ask)
    except RestoreOpenError as error:
        assert error.details["restore"] == "r1"
        return True
    return False


@pytest.mark.parametrize(
    ("of_block", "slug", "identity", "shut"),
    [
        (block(), "wtg-07/blade-1/pmc", SILENT, True),
        (block(), "wtg-07/blade-2/pmc", Identity(serial=4712), False),
        (block(), "wtg-99/blade-1/pmc", OURS, True),
        (block(), "wtg-99/blade-1/pmc", Identity(serial=4711), True),
        (block(), "wtg-99/blade-1/pmc", Identity(vendor_id=8, serial=4711), False),
        (block(), "wtg-99/blade-1/pmc", Identity(serial=4712), False),
        (block(), "wtg-99/blade-1/pmc", SILENT, False),
        (block(), "bus/can0/node-11", OURS, True),
        (block(), "bus/can0/node-11", SILENT, True),
        (block(), "bus/can0/node-11", Identity(serial=4712), False),
        (block("bus/can0"), "bus/can0/node-11", SILENT, True),
        (block("bus/can0"), "wtg-99/blade-1/pmc", SILENT, True),
        (block("bus/can0"), "wtg-99/blade-1/pmc", Identity(serial=4712), False),
        (block("bus/can0", SILENT), "bus/can0/node-11", OURS, True),
        (block("bus/can0", SILENT, "socketcan:can0"), "bus/can0/node-11", OURS, False),
        (block("wtg-07/blade-1", Identity(serial=0)), "wtg-99/blade-1/pmc", Identity(serial=0), False),
    ],
)
async def test_a_device_is_known_by_its_station_else_by_its_serial_number_else_by_its_place(
    of_block: Block, slug: str, identity: Identity, shut: bool
) -> None:
    assert await is_shut(gate(of_block), device(slug), identity) is shut


async def test_another_spelling_of_the_adapter_is_no_way_past_it() -> None:
    bare = block("bus/can0", SILENT)
    for other in ("socketcand:localhost:29536", "socketcand:LOCALHOST:29536/can0@250000", ADAPTER):
        assert await is_shut(gate(bare, adapter=other), device("bus/can0/node-11"), SILENT), other
    assert not await is_shut(gate(bare, adapter="socketcand:127.0.0.1:29537"), device("bus/can0/node-11"), SILENT)


async def test_the_device_is_not_asked_where_no_restore_is_open_or_its_name_decides() -> None:
    async def never() -> Identity:
        raise AssertionError("asked")

    await gate().check(device("wtg-07/blade-1/pmc"), never)
    with pytest.raises(RestoreOpenError):
        await gate(block()).check(device("wtg-07/blade-1/pmc"), never)
