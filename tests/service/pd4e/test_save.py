"""Saving by categories: what is kept, what is not, what proves it, and when it is refused."""

from __future__ import annotations

import pytest

from app.errors import PreconditionError, SdoAbortError
from app.model.address import Address, parse_address
from app.model.checks import Allow
from app.service.connection import Connection
from app.service.devices import Target
from app.service.journal import Kind
from app.service.save import Took, restart, save, save_each
from app.service.write import write_raw
from app.twins.object_store import RefusedAccessError
from app.wire.memory import StoredState
from app.wire.sdo import Abort
from tests.service.pd4e.conftest import SERVO, Served, read_one
from tests.web.rig import wait_until

TUNING, APPLICATION, DRIVE = Address(0x2031), Address(0x6065), Address(0x6073)
CONTROLWORD, MODE, TARGET_VELOCITY = Address(0x6040), Address(0x6060), Address(0x60FF)


@pytest.fixture
def servo(connection: Connection) -> Target:
    return connection.target(SERVO)


async def put(connection: Connection, servo: Target, address: Address, raw: int, allow: Allow = Allow.NOTHING) -> None:
    await write_raw(connection.driver(servo), servo, address, raw, connection.journal, allow=allow)


async def keep(connection: Connection, servo: Target, category: str | None = None) -> Took:
    return await save(connection.driver(servo), servo, connection.journal, connection.stamper, category)


async def start_anew(connection: Connection, servo: Target) -> Took:
    return await restart(connection.driver(servo), servo, connection.journal, connection.stamper)


def stored(servo: Target, address: Address) -> StoredState | None:
    view = servo.live.value(servo.device.bus, servo.node, address)
    return None if view is None or view.stored is None else view.stored.state


def told(connection: Connection, kind: Kind) -> list[dict[str, object]]:
    return [dict(one.details) for one in connection.journal.latest() if one.kind is kind]


async def test_a_category_is_saved_and_nothing_else(connection: Connection, served: Served, servo: Target) -> None:
    before = await read_one(connection, servo, APPLICATION)
    await put(connection, servo, TUNING, 1500)
    await put(connection, servo, APPLICATION, 300)
    await keep(connection, servo, "tuning")
    assert stored(servo, TUNING) is StoredState.SAVED
    assert stored(servo, APPLICATION) is None
    done = await start_anew(connection, servo)
    assert done.proven is True
    assert await read_one(connection, servo, TUNING) == 1500
    assert await read_one(connection, servo, APPLICATION) == before
    assert stored(servo, TUNING) is StoredState.PROVEN
    assert stored(servo, APPLICATION) is StoredState.PROVEN
    assert told(connection, Kind.SAVED_PART)[0]["category_key"] == "category.tuning"
    assert len(told(connection, Kind.SAVE_PROVEN)) == 1


async def test_what_was_proven_stays_so_when_the_watcher_sees_that_the_link_was_away(
    connection: Connection, servo: Target
) -> None:
    await put(connection, servo, TUNING, 1500)
    await keep(connection, servo)
    await start_anew(connection, servo)
    await read_one(connection, servo, TUNING)
    await wait_until(lambda: bool(told(connection, Kind.BUS_BACK)))
    assert stored(servo, TUNING) is StoredState.PROVEN


async def test_several_categories_are_saved_one_after_the_other(connection: Connection, servo: Target) -> None:
    values = {TUNING: 1500, APPLICATION: 300, DRIVE: 1200}
    for address, raw in values.items():
        await put(connection, servo, address, raw)
    driver, journal = connection.driver(servo), connection.journal
    await save_each(driver, servo, journal, connection.stamper, ("application", "drive", "tuning"))
    assert (await start_anew(connection, servo)).proven is True
    for address, raw in values.items():
        assert await read_one(connection, servo, address) == raw


async def test_a_restart_without_a_save_proves_none(connection: Connection, servo: Target) -> None:
    assert (await start_anew(connection, servo)).proven is None
    assert not told(connection, Kind.SAVE_PROVEN)


async def test_a_save_that_the_restart_does_not_bear_out_is_told(
    connection: Connection, served: Served, servo: Target
) -> None:
    await put(connection, servo, TUNING, 1500)
    await keep(connection, servo, "tuning")
    served.thread.call_soon(lambda: served.device.memory.discard(lambda _entry: True))
    assert (await start_anew(connection, servo)).proven is False
    assert await read_one(connection, servo, TUNING) != 1500
    assert len(told(connection, Kind.SAVE_NOT_PROVEN)) == 1


async def test_nothing_is_saved_while_the_motor_is_driven(
    connection: Connection, served: Served, servo: Target
) -> None:
    await put(connection, servo, TUNING, 1500)
    await put(connection, servo, MODE, 3, Allow.MOTION)
    for word in (6, 7, 15):
        await put(connection, servo, CONTROLWORD, word, Allow.MOTION)
    with pytest.raises(PreconditionError) as caught:
        await keep(connection, servo, "tuning")
    assert caught.value.details["found_key"] == "axis_state.operation_enabled"
    assert served.stored("2031") is None
    assert stored(servo, TUNING) is None


async def test_a_refusal_of_the_device_comes_with_its_abort_code_and_state(
    connection: Connection, served: Served, servo: Target
) -> None:
    served.device.store.at(parse_address("1010:06")).guard = _not_stored
    with pytest.raises(SdoAbortError) as caught:
        await keep(connection, servo, "tuning")
    assert caught.value.details["abort_code"] == 0x08000020
    assert str(caught.value.details["state_key"]).startswith("axis_state.")
    assert told(connection, Kind.SAVE_REFUSED) == [{"category_key": "category.tuning", "reason": "08000020h"}]


def _not_stored(_raw: object) -> None:
    raise RefusedAccessError(Abort.NOT_STORED)


async def test_a_category_that_the_device_does_not_have_is_refused(connection: Connection, servo: Target) -> None:
    with pytest.raises(PreconditionError):
        await keep(connection, servo, "blades")
