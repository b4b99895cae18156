"""The scope at a drive on Modbus TCP: its registers in one message, the rest one by one, and what was in force."""

from __future__ import annotations

import csv
import json
from collections.abc import AsyncIterator
from io import StringIO
from pathlib import Path

import pytest

from app.model.address import Address
from app.model.description_file import load_builtin
from app.model.site import read_site
from app.model.texts import load_texts
from app.recording.reader import open_recording
from app.service.connection import Connection
from app.service.office.audit import AuditLog
from app.service.options import Options
from app.service.polling import USUAL
from app.service.scope.captures import Captures
from app.service.scope.desk import ScopeDesk
from app.service.scope.export import csv_pieces, json_pieces
from app.service.scope.line import scope_line
from app.service.scope.series import each_once
from app.store.store import Store
from app.wire.decoders import decoder_of
from app.wire.records import Source, ValueSeen
from tests.drivers.modbus_rig import MODE, POSITION, STATUSWORD, TARGET, twin
from tests.service.scope.rig import kept, order, trigger, until

SLUG = "bench-pd4e/bench/servo"
CONTROLWORD, WINDOW, DEVIATION = Address(0x6040), Address(0x6065), Address(0x60F4)
MAPPED = (f"{SLUG}/6064", f"{SLUG}/6041", f"{SLUG}/6041.10")
BY_OBJECT = (f"{SLUG}/60F4", f"{SLUG}/606C")
TURN = 3600


@pytest.fixture
async def connection(tmp_path: Path) -> AsyncIterator[Connection]:
    with twin() as peer:
        site = f"""
schema = 1
[turbine.bench-pd4e.bus.lan]
connection = "modbus-tcp"
ranges = ["127.0.0.1:{peer.port}"]
[turbine.bench-pd4e.station.bench.device.servo]
description = "nanotec-pd4e"
node = 1
address = "{peer.server}"
"""
        (turbine,) = read_site(site, "site.toml")
        known = {"nanotec-pd4e": load_builtin("nanotec-pd4e")}
        async with Connection(turbine, known, Options("tester", tmp_path)) as opened:
            yield opened


@pytest.fixture
async def desk(connection: Connection) -> AsyncIterator[ScopeDesk]:
    store = Store.in_memory()
    audit = AuditLog(store, connection.stamper)
    made = ScopeDesk(Captures(store, audit), connection.journal, connection.stamper, lambda: USUAL, lambda: True)
    made.attach(connection)
    try:
        yield made
    finally:
        await made.close()
        await audit.close()
        store.close()


async def write(connection: Connection, address: Address, number: int, size: int) -> None:
    await connection.driver(connection.target(SLUG)).write(1, address, number.to_bytes(size, "little"))


async def enable(connection: Connection) -> None:
    """To Operation enabled in Profile position, with a turn as the target."""
    await write(connection, MODE, 1, 1)
    await write(connection, TARGET, TURN, 4)
    for word in (0x06, 0x07, 0x0F):
        await write(connection, CONTROLWORD, word, 2)


async def test_a_motion_is_caught_with_every_value_that_crossed_the_wire(
    connection: Connection, desk: ScopeDesk, tmp_path: Path
) -> None:
    await enable(connection)
    driver = connection.driver(connection.target(SLUG))
    assert int.from_bytes(await driver.read(1, WINDOW), "little") == 256
    for where in (0x60A8, 0x608F, 0x6091, 0x6092):
        await driver.read_many(1, [one.address for one in load_builtin("nanotec-pd4e") if one.address.major == where])
    on = trigger(kind="edge", signal=MAPPED[0], level=45.0, slope="rising")
    await desk.arm(connection, order(*MAPPED, *BY_OBJECT, on=on, total_s=0.6, pre_s=0.2), "tester")
    await until(lambda: all(one.rate_hz > 20 for one in scope_line(desk, True).signals))
    line = scope_line(desk, True)
    assert {one.way for one in line.signals} == {"polled"}, "nothing comes unasked"
    assert line.signals[0].unit == "°"
    await write(connection, CONTROLWORD, 0x1F, 2)
    (found,) = await kept(desk)
    capture = await desk.captures.get(found)
    head = capture.head
    raws = capture.values[0].raw.tolist()
    at = capture.values[0].t_ns.tolist().index(head.trigger_ns)
    assert raws[at - 1] < 450 <= raws[at]
    assert (head.ended, head.recording is not None) == ("complete", True)
    assert all(one.by_pdo == 0 for one in head.signals)
    rows = {row.address: row for row in await desk.captures.in_force(found)}
    assert rows["6065"].raw == "256"
    table = b"".join(csv_pieces(capture, load_texts("en"))).decode("utf-8-sig")
    assert len(list(csv.reader(StringIO(table)))) == 1 + len(each_once([one.t_ns for one in capture.values]))
    plain = json.loads(b"".join(json_pieces(capture, list(rows.values()))))
    assert plain["signals"][0]["unit"] == "°"
    assert len(plain["in_force"]) == len(rows)
    for written, values, signal in zip(plain["signals"], capture.values, head.signals, strict=True):
        assert (written["t_ns"], written["raw"]) == (values.t_ns.tolist(), values.raw.tolist())
        assert written["scaled"] == pytest.approx((values.raw * float(signal.scale)).tolist())
    await connection.close()
    assert connection.recording is not None
    with open_recording(tmp_path / str(head.recording)) as recording:
        server = next(iter(recording.servers.values()))
        seen = [
            one
            for one in decoder_of("lan", servers={1: server}).feed_all(recording.frames())
            if isinstance(one, ValueSeen) and head.start_ns <= one.t_ns <= head.end_ns
        ]
    for address, values in zip((POSITION, STATUSWORD, None, DEVIATION), capture.values, strict=False):
        if address is None:
            continue
        signed = address != STATUSWORD
        of_it = [one for one in seen if one.address == address]
        wanted = [(one.t_ns, int.from_bytes(one.data, "little", signed=signed)) for one in of_it]
        assert list(zip(values.t_ns.tolist(), values.raw.tolist(), strict=True)) == wanted
    after = [one.source for one in seen if one.address == POSITION and one.t_ns > head.trigger_ns]
    assert after.count(Source.PDO_TX) > 30, "by registers, once the order of their words is known"
    assert set(after) == {Source.PDO_TX}


async def test_a_fault_triggers_though_its_statusword_is_not_shown(connection: Connection, desk: ScopeDesk) -> None:
    """Nothing brings the statusword unasked: the scope reads what it is triggered by."""
    await write(connection, Address(0x3700), 2, 2)
    await write(connection, WINDOW, 0, 4)
    await write(connection, Address(0x6066), 0, 2)
    await enable(connection)
    await desk.arm(connection, order(BY_OBJECT[0], on=trigger(kind="fault", device=SLUG)), "tester")
    await until(lambda: scope_line(desk, True).signals[0].rate_hz > 20)
    await write(connection, CONTROLWORD, 0x1F, 2)
    (found,) = await kept(desk)
    head = (await desk.captures.get(found)).head
    assert (head.cause, head.ended) == ("trigger", "complete")
